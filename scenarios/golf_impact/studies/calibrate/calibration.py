"""A calibration: a contact law fitted to measurements, other laws, and what follows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import lmfit
import numpy as np

from golf_impact.api import run_impacts
from golf_impact.data.balls import Ball, ball_toml
from golf_impact.data.errors import UserError
from golf_impact.data.files import write
from golf_impact.data.quantities import format_options
from golf_impact.studies.calibrate import report
from golf_impact.studies.calibrate.fit import ContactLaw, Fit, chance_of
from golf_impact.studies.calibrate.measurements import Measurements, measurements, number
from golf_impact.studies.calibrate.series import IMPACT, Curve
from golf_impact.studies.intervals import RANGES, standard_errors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Kelvin–Voigt, which every calibration is compared with.
_LINEAR = ContactLaw(2, 1.0)

#: Club speeds (m/s) of predictions, and what is predicted there.
_SPEEDS = (30.0, 40.0, 50.0)
_PREDICTED = ("smash_factor", "coefficient_of_restitution", "ball_velocity")


class Interval(NamedTuple):
    """Predictions with their 95 % intervals, arrays of one shape."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Calibration(Fit):
    """A contact law fitted to measurements, compared with other laws.

    Attributes:
        data: the measurements.
        fits: the laws compared, as far as they could be fitted.
        chance_apart: the probability that the stiffnesses of several curves, each fitted with its
            own, differ as much by chance (a likelihood ratio).
        speeds, predictions: club speeds (m/s), and what `predict` gives there.
        Of `Fit`: result (lmfit's `MinimizerResult`), parameters, by their FMU names (SI units)
            value, standard error and 95 % interval, covariance, and all else.
    """

    def __init__(
        self,
        data: Measurements,
        law: ContactLaw,
        progress: Callable[[float, str], object] = lambda percent, title: None,
        fixed: Mapping[str, float] | None = None,
    ) -> None:
        self.data = data
        compared = [*dict.fromkeys((_LINEAR, law))]
        others = [one for one in compared if one != law] if data.sized else []
        apart = len(data.curves) > 1 and "k" not in (fixed or {})
        titles = [law.title, *[law.title] * apart, *(other.title for other in others)]
        steps = iter([(100.0 * n / len(titles), title) for n, title in enumerate(titles)])
        progress(*next(steps))
        super().__init__(data, law, False, fixed)
        self.chance_apart = 1.0
        if apart:
            progress(*next(steps))
            separate = Fit(data, law, True, fixed)
            self.chance_apart = chance_of(self.deviance - separate.deviance, len(data.curves) - 1)
        found: dict[ContactLaw, Fit] = {law: self}
        for other in others:
            progress(*next(steps))
            # With too few measurements a law isn't compared.
            with suppress(UserError):
                found[other] = Fit(data, other, False, fixed)
        self.fits = [found[one] for one in compared if one in found and data.sized]
        self.speeds = np.array(_SPEEDS)
        self.predictions: dict[str, Interval] = {}
        with suppress(UserError):  # a steep line of COR may end below these speeds
            self.predictions = self.predict(self.speeds)

    def predict(self, club_speeds: float | Sequence[float] | np.ndarray) -> dict[str, Interval]:
        """S, COR and ball speed (m/s) at club speeds (m/s, any shape), with 95 % intervals.

        The intervals follow from the covariance of the parameters, linearly; they hold if the law
        does. A parameter at its limit widens them to one side. UserError: the physics refuses a
        speed.
        """
        values = {**self.values, "club_speed": np.asarray(club_speeds, float)}
        found = run_impacts(_PREDICTED, **values)
        if found.reason:
            raise UserError(found.reason)
        names, covariance = self._uncertain({*self.parameters} - {"club_speed"})
        errors = standard_errors(_PREDICTED, values, names, covariance)
        ends = {
            name: one.interval for name, one in self.parameters.items() if one.limit is not None
        }
        moved = [
            run_impacts(_PREDICTED, **{**values, name: end}) for name in ends for end in ends[name]
        ]
        predicted = {}
        for output, value in found.items():
            low = high = self.coverage * errors[output]
            for change in (np.nan_to_num(one[output] - value) for one in moved):
                low = np.hypot(low, np.minimum(change, 0.0))
                high = np.hypot(high, np.maximum(change, 0.0))
            predicted[output] = Interval(value, value - low, value + high)
        return predicted

    def _uncertain(self, chosen: set[str]) -> tuple[list[str], np.ndarray]:
        """Those of these parameters that aren't at a limit, and their covariance."""
        free = {n: one.limit is None and n in chosen for n, one in self.parameters.items()}
        places = np.flatnonzero([*free.values()])
        return [name for name in free if free[name]], self.covariance[np.ix_(places, places)]

    @property
    def ball(self) -> Ball:
        """The ball that was found; `**ball.values` are inputs and parameters of the FMU."""
        data, values, measured = self.data, self.values, [*self.data.targets.measured]
        for one in data.series.values():
            # Each curve has conditions of its own.
            at = f" ({report.describe_impact(one.impact)})" if isinstance(one, Curve) else ""
            measured.append(f"{len(one.y)} rows of {one.name}{at}")
        source = f"golf-impact calibrate: {', '.join(measured)}"
        if data.targets.measured:
            source += f"; {report.describe_impact(data.impact)}"
        # The impact isn't part of the ball, but for a mass of its own.
        own_mass = values["m_ball"] != IMPACT["m_ball"]
        of_impact = {*IMPACT} - ({"m_ball"} if own_mass else set())
        names, covariance = self._uncertain({*RANGES})
        limits = report.describe_limits(self.parameters)
        # Nobody has measured a stiffness that nothing depends on.
        undetermined = () if "k" in values else ("k",)
        speeds = [one.impact["club_speed"] for one in data.curves.values()]
        speeds += [*data.cor_speeds.x] if data.cor_speeds else []
        return Ball(
            name="calibrated",
            title=f"calibrated, {self.title}",
            values={name: value for name, value in values.items() if name not in of_impact},
            source=source,
            uncertain=tuple(names),
            covariance=tuple(map(tuple, covariance.tolist())),
            conditions={n: values[n] for n in IMPACT if n != "m_ball" and n in data.given},
            speeds=(float(min(speeds)), float(max(speeds))) if speeds else (),
            undetermined=undetermined,
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
        pairs = {name: v for name, v in self.values.items() if IMPACT.get(name) != v}
        return f"golf-impact run {format_options(pairs)}"

    def fit_report(self) -> str:
        """lmfit's report: statistics, parameters that aren't rounded, correlations."""
        return lmfit.fit_report(self.result)

    def draw(self) -> Figure:
        """Data, fit with 95 % bands, and residuals."""
        from golf_impact.studies.calibrate.figure import draw

        return draw(self)

    def __repr__(self) -> str:
        found = [f"  {name} = {text}" for name, text, _ in self.tables()[0][2]]
        square = self.chi_squared if self.chi_squared >= 5e-4 else 0.0
        freedom = f"degrees of freedom {self.degrees_of_freedom}"
        title = f"Calibration: {self.title} (law {self.law.law})"
        return "\n".join([title, *found, f"  χ² = {square:.3f}, {freedom}"])

    words = property(report.sentences)
    tables = report.tables
    as_json = report.as_json


def calibrate(
    curve: Any = None,
    cor_speeds: Any = None,
    *,
    shots: Path | str | None = None,
    exponent: float | str = 1.0,
    columns: str = "",
    window: tuple[float, float] | str | None = None,
    baseline: str = "",
    fix: Mapping[str, Any] | None = None,
    prior: Mapping[str, Any] | None = None,
    progress: Callable[[float, str], object] = lambda percent, title: None,
    **scalars: Any,
) -> Calibration:
    """Fit a contact law to measurements of an impact on a ball at rest, all together (SI units).

    Args:
        curve: a measured force curve, any zero of time: `(time, force)` or `(time, force, sigma)`,
            arrays in s and N, a mapping (or data frame) of these columns, or a CSV file of them,
            perhaps with other units in its header. It needs club_speed and m_club. Or a list of
            several files or mappings; a file's name may end with @ and its club speed, a mapping
            may have club_speed, m_club and m_ball.
        cor_speeds: likewise `(approach_speed, cor[, sigma])`; fits restitution_at_rest and
            restitution_slope in place of b.
        shots: a CSV file of a launch monitor with club and ball speed of each shot, instead of
            cor_speeds; mishits are left out.
        exponent: n of law 2's power law, or "free" to fit it too.
        columns: heads or numbers of time, force and σ in files of curves, with units or a sensor's
            sensitivity: "t [ms],F [kN]", "TIME [s],CH2 [2 kN/V]".
        window: first and last instant of curves that count, s, or text such as "0:2ms".
        baseline: of the sensor in curves, fitted too: zero, constant (an offset) or linear (with a
            drift); by default that with the least AIC for the rows before and after contact.
        fix: law parameters that aren't fitted, by name (`n` is the exponent).
        prior: what is known of parameters of law or impact, by name: a value and its σ,
            `{"m_club": (0.2, 0.002)}`; it is fitted with the measurements.
        progress: called before each fit with the progress in per cent and its law's title.
        scalars: ball_speed, club_speed_after, cor, contact_time, max_force, time_of_max_force,
            smash_factor, energy_efficiency, impulse, max_compression and contact_displacement, also
            by their FMU outputs; each a number or with its σ (1 % by default), `(0.743, 0.005)` or
            "0.743±0.005"; club_speed (35 m/s), m_club (0.210 kg) and m_ball (0.04593 kg) of them
            and the curve.

    Raises:
        UserError: measurements are impossible or too few.

    Example:
        >>> found = calibrate(cor=(0.743, 0.005), contact_time="600±6us", club_speed=35.0)
        >>> [f"{one.value:.3g} ± {one.standard_error:.1g}" for one in found.parameters.values()]
        ['9.14e+05 ± 2e+04', '37.3 ± 0.9']
        >>> found.predict(45.0)["smash_factor"].value.round(3).item()
        1.43
    """
    fixed, priors = (
        {"exponent" if name == "n" else name: value for name, value in (given or {}).items()}
        for given in (fix, prior)
    )
    if other := [name for name in fixed if name not in RANGES]:
        raise UserError(f"fix {other[0]} is refused: choose from n, {', '.join(RANGES)}")
    fixed = {name: number(value, name, "fix") for name, value in fixed.items()}
    exponent = fixed.pop("exponent", "free" if "exponent" in priors else exponent)
    chosen = ContactLaw.of(exponent)
    data = measurements(scalars, curve, cor_speeds, columns, baseline, priors, window, shots)
    return Calibration(data, chosen, progress, fixed)
