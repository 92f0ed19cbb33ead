"""A calibration: a contact law fitted to measurements, beside other laws, and what follows."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from golf_impact.api import run_impacts
from golf_impact.ball import Ball, ball_toml
from golf_impact.calibration import report
from golf_impact.calibration.fit import Estimate, Fit, chance_of
from golf_impact.calibration.intervals import RANGES, standard_errors
from golf_impact.calibration.measurements import (
    IMPACT,
    Measurements,
    measurements,
    number,
)
from golf_impact.calibration.model import ContactLaw
from golf_impact.errors import UserError
from golf_impact.files import write
from golf_impact.quantities import (
    format_options,
)

#: Kelvin–Voigt, absolute, Tsuji and free n, which every calibration is compared with.
_COMPARED = ((2, 1.0), (1, 1.0), (2, 1.5), (2, None))

#: What is predicted at other club speeds.
_PREDICTED = ("smash_factor", "coefficient_of_restitution", "ball_velocity")


class Interval(NamedTuple):
    """Predictions with their 95 % intervals, arrays of one shape."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Calibration:
    """A contact law fitted to measurements, beside other laws.

    Attributes:
        data: the measurements.
        fit: all of the fit, with arrays over the measured values.
        result: the fit as lmfit's `MinimizerResult`.
        parameters: of the fitted parameters by their FMU names (SI units) value, standard error and
            95 % interval; one at its limit has no standard error, and a one-sided interval.
        covariance: of the parameters, (p, p); 0 for one at its limit.
        chi_squared, degrees_of_freedom: of the fit.
        residuals: (model − measured)/σ of `targets`, `curve` and `cor_speeds`.
        fits: the laws compared, as far as they could be fitted.
        apart: the same law with a stiffness for each of several curves; otherwise None.
        stiffnesses: these by curve; chance_apart: the probability that they differ as much by
            chance (a likelihood ratio).
        speeds, predictions: club speeds (m/s), and what `predict` gives there.
    """

    def __init__(
        self,
        data: Measurements,
        law: ContactLaw,
        speeds: Sequence[float] | None = None,
        progress: Callable[[float, str], object] = lambda percent, title: None,
        fixed: Mapping[str, float] | None = None,
        profile: bool = False,
    ) -> None:
        self.data = data
        compared = [ContactLaw(n, m, law.reference_compression) for n, m in _COMPARED]
        others = [one for one in compared if one != law] if data.sized else []
        several = len(data.curves) > 1
        total, begun = 1 + several + len(others), itertools.count()

        def fit(law: ContactLaw, apart: bool = False, profile: bool = False) -> Fit:
            before, ticks = next(begun), itertools.count(1)

            def tick() -> None:
                # How many steps it takes isn't known: each is a fifth of the rest.
                progress(100.0 * (before + 1.0 - 0.8 ** next(ticks)) / total, law.title)

            return Fit(data, law, apart, tick, fixed, profile)

        self.fit = best = fit(law, profile=profile)
        self.apart = fit(law, apart=True) if several and "k" not in (fixed or {}) else None
        found = {law: best}
        for other in others:
            # With too few measurements a law isn't compared.
            with suppress(UserError):
                found[other] = fit(other)
        self.fits = [found[one] for one in compared if one in found] if data.sized else []
        self.result = best.result
        self.parameters, self.covariance = best.parameters, best.covariance
        self.chi_squared, self.degrees_of_freedom = best.chi_squared, best.degrees_of_freedom
        groups = ["targets"] * bool(data.targets) + [*data.series]
        self.residuals = {name: best.residuals[data.groups[name]] for name in groups}
        if speeds is None:
            own = [one.impact["club_speed"] for one in data.curves.values()]
            own = own or [data.impact["club_speed"]]
            middle = data.cor_speeds.x.mean() if data.cor_speeds else sum(own) / len(own)
            speeds = [float(f"{middle * factor:.2g}") for factor in (0.6, 0.8, 1.0, 1.2, 1.4)]
        self.stiffnesses, self.chance_apart = self._compare_stiffnesses()
        self.speeds = np.array(speeds, float)
        try:
            self.predictions = self.predict(self.speeds)
        except UserError as error:
            words = ", ".join(f"{speed:g}" for speed in speeds)
            why = "give speeds nearer to those measured (--predict)"
            raise UserError(f"no prediction at {words} m/s: {error}; {why}") from error

    def _compare_stiffnesses(self) -> tuple[dict[str, Estimate], float]:
        if not self.apart:
            return {}, 1.0
        found = {
            f"{curve.name}, {curve.impact['club_speed']:g} m/s": self.apart.parameters[
                name.replace("curve", "k")
            ]
            for name, curve in self.data.curves.items()
        }
        return found, chance_of(self.fit.deviance - self.apart.deviance, len(found) - 1)

    def predict(self, club_speeds: float | Sequence[float] | np.ndarray) -> dict[str, Interval]:
        """S, COR and ball speed (m/s) at club speeds (m/s, any shape), with 95 % intervals.

        The intervals follow from the covariance of the parameters, linearly; they hold if the law
        does. A parameter at its limit widens them to one side. UserError: the physics refuses a
        speed.
        """
        values = {**self.fit.values, "club_speed": np.asarray(club_speeds, float)}
        found = run_impacts(_PREDICTED, **values)
        if found.reason:
            raise UserError(found.reason)
        names = [n for n, one in self.parameters.items() if one.limit is None and n != "club_speed"]
        at = [[*self.parameters].index(name) for name in names]
        errors = standard_errors(_PREDICTED, values, names, self.covariance[np.ix_(at, at)])
        low, high = {}, {}
        for output in _PREDICTED:
            low[output] = high[output] = self.fit.coverage * errors[output] if names else 0.0
        for name, one in self.parameters.items():
            if one.limit is None:
                continue
            (far,) = {*one.interval} - {one.limit}
            moved = run_impacts(_PREDICTED, **{**values, name: far})
            for output in _PREDICTED:
                change = np.nan_to_num(moved[output] - found[output])
                low[output] = np.hypot(low[output], np.minimum(change, 0.0))
                high[output] = np.hypot(high[output], np.maximum(change, 0.0))
        return {
            output: Interval(value, value - low[output], value + high[output])
            for output, value in found.items()
        }

    @property
    def ball(self) -> Ball:
        """The ball that was found; `**ball.values` are inputs and parameters of the FMU."""
        data, fit, names = self.data, self.fit, [*self.data.targets]
        for one in data.series.values():
            # Each curve has conditions of its own.
            at = f" ({report.describe_impact(one.impact)})" if one.impact else ""
            names.append(f"{len(one.y)} rows of {one.name}{at}")
        measured = ", ".join(names)
        if data.targets or not data.curves:
            measured += f"; {report.describe_impact(data.impact)}"
        # The impact isn't part of the ball, but for a mass of its own.
        of_ball = {*fit.values}.difference(IMPACT)
        if fit.values["m_ball"] != IMPACT["m_ball"]:
            of_ball.add("m_ball")
        conditions = {n: fit.values[n] for n in IMPACT if n != "m_ball" and fit.values[n]}
        limits = report.describe_limits(self.parameters)
        known = [n for n in self.parameters if n in RANGES and n not in limits]
        places = [[*self.parameters].index(name) for name in known]
        return Ball(
            name="calibrated",
            title=f"calibrated, {fit.title}",
            values={name: v for name, v in fit.values.items() if name in of_ball},
            source=f"golf-impact calibrate: {measured}",
            uncertain=tuple(known),
            covariance=tuple(map(tuple, self.covariance[np.ix_(places, places)].tolist())),
            conditions=conditions,
            limits="; ".join(f"{n} is at its limit: {end} (95 %)" for n, end in limits.items()),
        )

    def save(self, path: Path | str) -> Path:
        """Write the ball as a TOML file, for `--ball FILE.toml` and `golf_impact.read_ball`.

        UserError: the name doesn't end in .toml, or the file can't be written.
        """
        path = Path(path)
        if path.suffix != ".toml":
            raise UserError(f"{path} is refused: the name of a ball's file must end in .toml")
        return write(path, ball_toml(self.ball))

    @property
    def command(self) -> str:
        """The command line that reproduces the impact with all results printed of it."""
        pairs = {name: v for name, v in self.fit.values.items() if IMPACT.get(name) != v}
        return f"golf-impact run {format_options(pairs)}"

    def fit_report(self) -> str:
        """lmfit's report: statistics, parameters that aren't rounded, correlations."""
        import lmfit

        return lmfit.fit_report(self.result)

    def draw(self) -> Any:
        """The figure, a `matplotlib.figure.Figure`: data, fit with 95 % bands, and residuals."""
        from golf_impact.calibration.figure import draw

        return draw(self)

    def __repr__(self) -> str:
        found = [f"  {name} = {text}" for name, text, _ in self.tables()[0].rows]
        title = f"Calibration: {self.fit.title} (law {self.fit.law.law})"
        square = self.chi_squared if self.chi_squared >= 5e-4 else 0.0
        freedom = f"degrees of freedom {self.degrees_of_freedom}"
        return "\n".join([title, *found, f"  χ² = {square:.3f}, {freedom}"])

    @property
    def words(self) -> list[str]:
        """What the numbers say, in sentences."""
        return report.sentences(self)

    def tables(self) -> list[report.Table]:
        """Parameters, measurements, predictions, and the comparison of laws."""
        return report.tables(self)

    def as_json(self) -> dict[str, Any]:
        """All of it, for calibrate.json (SI units); null where something isn't defined."""
        return report.as_json(self)


def calibrate(
    curve: Any = None,
    cor_speeds: Any = None,
    *,
    law: int = 2,
    exponent: float | str = 1.0,
    reference_compression: float = 0.005,
    csv: Path | None = None,
    columns: str = "",
    baseline: str = "",
    fix: Mapping[str, Any] | None = None,
    prior: Mapping[str, Any] | None = None,
    profile: bool = False,
    predict: Sequence[float] | None = None,
    progress: Callable[[float, str], object] = lambda percent, title: None,
    **scalars: Any,
) -> Calibration:
    """Fit a contact law to measurements of an impact on a ball at rest, all together (SI units).

    Args:
        curve: a measured force curve with an unknown instant of touch: `(time, force)` or `(time,
            force, sigma)`, arrays in s and N, a mapping (or data frame) of these columns, or a CSV
            file of them, perhaps with other units in its header. It needs club_speed and m_club.
            Or a list of several files or mappings; a file's name may end with @ and its club speed,
            a mapping may have club_speed, m_club, m_ball and club_force; or a TOML file with tables
            `[[curve]]` of file, columns and these.
        cor_speeds: likewise `(approach_speed, cor[, sigma])`; fits restitution_at_rest and
            restitution_slope in place of b.
        law: 1 (absolute) or 2 (relative).
        exponent: n of law 2's power law, or "free" to fit it too.
        reference_compression: at which k and b hold, m.
        csv: a CSV file of scalars with the columns target,value,sigma.
        columns: heads or numbers of time, force and σ in files of curves, with units or a sensor's
            sensitivity: "t [ms],F [kN]", "TIME [s],CH2 [2 kN/V]".
        baseline: of the sensor in curves, fitted too: zero, constant (an offset) or linear (with a
            drift); by default that with the least AIC for the rows before and after contact.
        fix: law parameters that aren't fitted, by name (`n` is the exponent).
        prior: what is known of parameters of law or impact, by name: a value and its σ,
            `{"m_club": (0.2, 0.002)}`; it is fitted with the measurements.
        profile: 95 % intervals by lmfit's `conf_interval`, where χ² rises, not by standard errors.
        predict: club speeds to predict S, COR and ball speed at, m/s.
        progress: called now and then with the progress in per cent and a law's title.
        scalars: ball_speed, club_speed_after, cor, contact_time, max_force, time_of_max_force,
            smash_factor, energy_efficiency, impulse, max_compression and contact_displacement, also
            by their FMU outputs; each a number or with its σ, `(0.743, 0.005)` or "0.743±0.005",
            or with the σ apart as sigma_cor and so on (1 % by default); club_speed (35 m/s), m_club
            (0.210 kg), m_ball (0.04593 kg) and club_force (0 N) of them and the curve.

    Raises:
        UserError: measurements are impossible or too few.
    """
    fixed = {name if name != "n" else "exponent": value for name, value in (fix or {}).items()}
    if other := [name for name in fixed if name not in RANGES]:
        raise UserError(f"fix {other[0]} is refused: choose from n, {', '.join(RANGES)}")
    fixed = {name: number(value, name, "fix") for name, value in fixed.items()}
    priors = {name if name != "n" else "exponent": value for name, value in (prior or {}).items()}
    exponent = fixed.pop("exponent", "free" if "exponent" in priors else exponent)
    chosen = ContactLaw.of(law, exponent, reference_compression)
    data = measurements(scalars, csv, curve, cor_speeds, columns, baseline, priors)
    speeds = None if predict is None else [number(one, "predict") for one in predict]
    return Calibration(data, chosen, speeds, progress, fixed, profile)
