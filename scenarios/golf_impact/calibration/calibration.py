"""A calibration: a contact law fitted to measurements, beside other laws, and what follows."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from golf_build import VERSION
from golf_impact.arrays.impacts import impacts
from golf_impact.arrays.sensitivities import sensitivities
from golf_impact.ball import Ball, ball_toml
from golf_impact.calibration.fit import ContactLaw, Estimate, Fit
from golf_impact.calibration.measurements import (
    DEFAULT_SIGMA,
    IMPACT,
    TARGETS,
    Measurements,
    measurements,
    number,
)
from golf_impact.errors import UserError, missing_package
from golf_impact.files import write_together
from golf_impact.quantities import QUANTITIES, format_options, format_unit, format_with_error
from golf_impact.report.outcome import Table
from golf_impact.report.uncertainty import gradient, standard_errors
from golf_impact.units import unit_of

#: What is worth a sentence: a χ² that law and σ exceed less often than this, a lag-1
#: autocorrelation of a curve's residuals, times √rows, above this, an AIC lower by this.
_UNLIKELY, _CORRELATED, _BETTER = 0.01, 4.0, 2.0

#: The impact in which scalars and curve were measured, in words.
_IMPACT = "{club_speed:g} m/s, club {m_club:g} kg, ball {m_ball:g} kg"


def _in_words(impact: Mapping[str, float]) -> str:
    pushed = ", head pushed by {club_force:g} N" if impact["club_force"] else ""
    return (_IMPACT + pushed).format(**impact)


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
        parameters: value and standard error of the fitted parameters by their FMU names (SI units).
        covariance: of the parameters, (p, p); 0 for one at its limit.
        chi_squared, degrees_of_freedom: of the fit.
        residuals: (model − measured)/σ of `targets`, `curve` and `cor_speeds`.
        fits: the laws compared, as far as they could be fitted.
        apart: the same law with a stiffness for each of several curves; otherwise None.
        speeds, predictions: club speeds (m/s), and what `predict` gives there.
    """

    def __init__(
        self,
        data: Measurements,
        law: ContactLaw,
        speeds: Sequence[float] | None = None,
        progress: Callable[[float, str], object] = lambda percent, title: None,
    ) -> None:
        self.data, self.fits = data, list[Fit]()
        compared = [ContactLaw(n, m, law.reference_compression) for n, m in _COMPARED]
        others = [one for one in compared if one != law] if data.sized else []
        several = len(data.curves) > 1
        total, begun = 1 + several + len(others), itertools.count()

        def fit(law: ContactLaw, apart: bool = False) -> Fit:
            before, ticks = next(begun), itertools.count(1)

            def tick() -> None:
                # How many steps it takes isn't known: each is a fifth of the rest.
                progress(100.0 * (before + 1.0 - 0.8 ** next(ticks)) / total, law.title)

            return Fit(data, law, apart, tick)

        self.fit = best = fit(law)
        self.apart = fit(law, apart=True) if several else None
        found = {law: best}
        for other in others:
            # With too few measurements a law isn't compared.
            with suppress(UserError):
                found[other] = fit(other)
        self.fits = [found[one] for one in compared if one in found] if data.sized else []
        self.parameters, self.covariance = best.parameters, best.covariance
        self.chi_squared, self.degrees_of_freedom = best.chi_squared, best.degrees_of_freedom
        self.residuals = {name: best.residuals[rows] for name, rows in data.groups.items()}
        if speeds is None:
            own = [one.impact["club_speed"] for one in data.curves.values()]
            own = own or [data.impact["club_speed"]]
            middle = data.cor_speeds.x.mean() if data.cor_speeds else sum(own) / len(own)
            speeds = [float(f"{middle * factor:.2g}") for factor in (0.6, 0.8, 1.0, 1.2, 1.4)]
        self.speeds = np.array(speeds, float)
        try:
            self.predictions = self.predict(self.speeds)
        except UserError as error:
            words = ", ".join(f"{speed:g}" for speed in speeds)
            why = "give speeds nearer to those measured (--predict)"
            raise UserError(f"no prediction at {words} m/s: {error}; {why}") from error

    def predict(self, club_speeds: float | Sequence[float] | np.ndarray) -> dict[str, Interval]:
        """S, COR and ball speed (m/s) at club speeds (m/s, any shape), with 95 % intervals.

        The intervals follow from the covariance of the parameters, linearly; they hold if the law
        does. UserError: the physics refuses a speed.
        """
        speeds = np.asarray(club_speeds, float)

        def evaluate(values: Mapping[str, float]) -> np.ndarray:
            cases = {**values, "club_speed": speeds}
            outcome = impacts(_PREDICTED, cases, speeds.shape)
            if outcome.reason:
                raise UserError(outcome.reason)
            return np.array([outcome.columns[name] for name in _PREDICTED])

        values = self.fit.values
        # A parameter at its limit has no variance.
        names = [name for name, one in self.parameters.items() if one.standard_error]
        try:
            found = sensitivities(_PREDICTED, names, {**values, "club_speed": speeds})
            slopes = np.array([[found[name][of] for name in _PREDICTED] for of in names])
        except UserError:
            slopes = gradient(evaluate, values, names)
        at = [[*self.parameters].index(name) for name in names]
        errors = standard_errors(slopes, self.covariance[np.ix_(at, at)]) if names else 0.0
        value, half = evaluate(values), self.fit.coverage * errors
        return dict(zip(_PREDICTED, map(Interval, value, value - half, value + half)))

    @property
    def ball(self) -> Ball:
        """The ball that was found; `**ball.values` are inputs and parameters of the FMU."""
        data, names = self.data, [*self.data.targets]
        for one in data.series.values():
            # Each curve has conditions of its own.
            at = f" ({_in_words(one.impact)})" if one.impact else ""
            names.append(f"{len(one.y)} rows of {one.name}{at}")
        measured = ", ".join(names)
        if data.targets or not data.curves:
            measured += f"; {_in_words(data.impact)}"
        # The impact isn't part of the ball, but for a mass of its own.
        of_ball = {*self.fit.values}.difference(IMPACT)
        if data.impact["m_ball"] != IMPACT["m_ball"]:
            of_ball.add("m_ball")
        conditions = {name: v for name, v in data.impact.items() if v and name != "m_ball"}
        return Ball(
            name="calibrated",
            title=f"calibrated, {self.fit.title}",
            values={name: v for name, v in self.fit.values.items() if name in of_ball},
            source=f"golf-impact calibrate: {measured}",
            uncertain=tuple(self.parameters),
            covariance=tuple(map(tuple, self.covariance.tolist())),
            conditions=conditions,
        )

    def save(self, path: Path | str) -> Path:
        """Write the ball as a TOML file, for `--ball FILE.toml` and `golf_impact.read_ball`.

        UserError: the name doesn't end in .toml, or the file can't be written.
        """
        path = Path(path)
        if path.suffix != ".toml":
            raise UserError(f"{path} is refused: the name of a ball's file must end in .toml")
        return write_together(path.parent, {path.name: ball_toml(self.ball).encode()})[0]

    @property
    def command(self) -> str:
        """The command line that reproduces the impact with all results printed of it."""
        pairs = {name: v for name, v in self.fit.values.items() if IMPACT.get(name) != v}
        return f"golf-impact run {format_options(pairs)}"

    def __repr__(self) -> str:
        found = [f"  {name} = {text}" for name, text in self.tables()[0].rows]
        freedom = f"degrees of freedom {self.degrees_of_freedom}"
        title = f"Calibration: {self.fit.title} (law {self.fit.law.law})"
        return "\n".join([title, *found, f"  χ² = {self.chi_squared:.3f}, {freedom}"])

    @property
    def words(self) -> list[str]:
        """What the numbers say, in sentences."""
        best, data, words = self.fit, self.data, []
        for name, (value, error) in self.parameters.items():
            if error is None:
                words.append(f"{name} = {value:.6g} is at its limit: it has no standard error.")
        if default := [name for name, one in data.targets.items() if not one.stated]:
            words.append(f"σ is taken as {DEFAULT_SIGMA * 100:g} % of {', '.join(default)}.")
        for curve in data.curves.values():
            words += [f"{curve.name}: {note}." for note in curve.notes]
        for name in best.estimated:
            sigma = best.sigma[data.groups[name]][0]
            what = f"σ of {data.series[name].name}, {sigma:.3g}, follows from its residuals"
            words.append(f"{what}; so χ² doesn't test the law.")
        chance, freedom = best.probability, best.degrees_of_freedom
        square = f"χ² = {best.chi_squared:.3g} with {freedom} degrees of freedom"
        if chance is not None and chance < _UNLIKELY:
            why = "the law is wrong, σ is too small, or measurements contradict each other"
            words.append(f"This law doesn't fit: {square} (probability {chance:.1g}); {why}.")
        elif chance is not None:
            chances = f"(probability of a larger one: {chance:.2g})"
            words.append(f"{square} is compatible with law and σ {chances}.")
        elif freedom <= 0:
            met = "meets them exactly, so χ² doesn't test the law"
            if best.chi_squared > 1e-4:
                met = f"can't meet them together ({square}) and comes as near as it can"
            words.append(f"No more targets than parameters: {best.title} {met}.")
        for name, curve in data.curves.items():
            # Lag-1 autocorrelation in contact; of independent residuals it is normal, 1/√rows.
            inside = self.residuals[name][curve.contact]
            correlation = float(inside[1:] @ inside[:-1]) / max(float(inside @ inside), 1e-300)
            if correlation * math.sqrt(len(inside)) > _CORRELATED:
                why = "the law misses its shape, or the noise is correlated; errors are too small"
                words.append(f"Residuals of the {name} are correlated ({correlation:.2f}): {why}.")
        if self.apart:
            gain = best.aic - self.apart.aic
            which = "describes them better" if gain > _BETTER else "describes them no better"
            holds = "doesn't hold" if gain > _BETTER else "holds"
            ranks = f"A stiffness for each curve {which} (ΔAIC {-gain:+.3g})"
            words.append(f"{ranks}: the law {holds} over these speeds.")
        better = min((best, *self.fits), key=lambda other: other.aic)
        if best.aic - better.aic > _BETTER and not best.is_exact:
            lower = f"its AIC is lower by {best.aic - better.aic:.3g}"
            words.append(f"{better.title} describes these measurements better: {lower}.")
        return words

    def tables(self) -> list[Table]:
        """Parameters, measurements, predictions, and the comparison of laws."""
        best, data = self.fit, self.data
        found = dict(self.parameters) | {
            name.replace("curve", "touch_time"): one for name, one in best.touches.items()
        }
        parameters = [
            [name, f"{format_with_error(*one)} {format_unit(unit_of(name.split()[0]))}".rstrip()]
            for name, one in found.items()
        ]
        rows = []
        for (name, target), residual in zip(data.targets.items(), best.residuals):
            one = QUANTITIES[TARGETS[name]]
            measured, model = map(one.format_value, (target.value, best.predicted[name]))
            sigma = f"{target.sigma * one.factor:.2g}"
            rows.append([one.label, measured, sigma, model, f"{residual:+.2f}"])
        for name, series in data.series.items():
            rms = f"rms {np.sqrt(np.mean(self.residuals[name] ** 2)):.2f}"
            if series.impact:
                rms += f" ({best.rms[name]:.3g} N), {series.impact['club_speed']:g} m/s"
            sigma = f"{np.mean(best.sigma[data.groups[name]]):.3g}"
            rows.append([series.name, f"{len(series.y)} rows", sigma, "", rms])
        speeds = []
        for n, speed in enumerate(self.speeds):
            ends = ((one.value[n], one.high[n] - one.value[n]) for one in self.predictions.values())
            speeds.append([f"{speed:g}", *(format_with_error(*pair) for pair in ends)])
        # Nothing is ranked by rounding.
        ranked = [one.aic for one in self.fits if not one.is_exact]
        exact, laws = len(ranked) < len(self.fits), []
        for law in self.fits:
            values = ", ".join(f"{name} = {v.value:.4g}" for name, v in law.parameters.items())
            sizes = [f"{law.rms[name]:.4g}" for name in data.curves] or [f"{law.chi_squared:.3g}"]
            delta = "exact" if law.is_exact else "–" if exact else f"{law.aic - min(ranked):.4g}"
            laws.append([law.law.title, values, ", ".join(sizes), delta])
        size = "rms residual (N)" if data.curves else "χ²"
        square = f"χ² = {best.chi_squared:.4g}, degrees of freedom {best.degrees_of_freedom}"
        at = f"{len(data.curves)} curves" if self.apart else _in_words(data.impact)
        heads = ["", "measured", "σ", "model", "residual (σ)"]
        labels = ["club speed (m/s)", *(QUANTITIES[name].label for name in _PREDICTED)]
        tables = [
            Table(f"{best.title} (law {best.law.law})", ["", "value ± standard error"], parameters),
            Table(f"Measurements, {at}: {square}", heads, rows),
            Table("Predictions with 95 % intervals, if the law holds", labels, speeds),
            Table("Contact laws compared", ["", "parameters", size, "ΔAIC"], laws),
        ]
        alone = {"all": best.parameters["k"], **self._stiffnesses()} if self.apart else {}
        rows = [[name, format_with_error(*one)] for name, one in alone.items()]
        tables.append(Table("Stiffness by curve", ["", "k (N/m)"], rows))
        return [table for table in tables if table.rows]

    def _stiffnesses(self) -> dict[str, Estimate]:
        """By curve, the stiffness that fits it; the other parameters are shared."""
        found = self.apart.parameters if self.apart else {}
        return {
            f"{curve.name}, {curve.impact['club_speed']:g} m/s": found[name.replace("curve", "k")]
            for name, curve in self.data.curves.items()
            if found
        }

    def as_json(self) -> dict[str, Any]:
        """All of it, for calibrate.json (SI units); null where something isn't defined."""
        best, data = self.fit, self.data
        targets = [
            {"name": name, "target": one.value, "sigma": one.sigma, "sigma_given": one.stated}
            | {"model": best.predicted[name], "residual": float(residual)}
            for (name, one), residual in zip(data.targets.items(), best.residuals)
        ]
        series = {
            name: {"name": one.name, "rows": len(one.y), "sigma_given": one.sigma is not None}
            | ({"conditions": dict(one.impact)} if one.impact else {})
            | ({"touch_time": best.touches[name]._asdict()} if name in best.touches else {})
            | {"sigma": float(np.mean(best.sigma[data.groups[name]]))}
            for name, one in data.series.items()
        }
        predictions: list[dict[str, Any]] = [{"club_speed": v} for v in self.speeds.tolist()]
        for name, interval in self.predictions.items():
            for row, *ends in zip(predictions, *(part.tolist() for part in interval)):
                row[name] = dict(zip(Interval._fields, ends))
        return {
            "version": VERSION,
            "command": self.command,
            "conditions": dict(data.impact),
            **best.as_json(),
            "touch_time": next((one._asdict() for one in best.touches.values()), None),
            "targets": targets,
            "series": series,
            "predictions": predictions,
            "notes": self.words,
            "comparison": [one.as_json() for one in self.fits],
            "stiffness_by_curve": {n: one._asdict() for n, one in self._stiffnesses().items()},
        }

    def draw(self) -> Any:
        """The figure, a `matplotlib.figure.Figure`: data, fit with 95 % bands, and residuals."""
        from golf_impact.calibration.drawing import draw

        return draw(self)


def calibrate(
    curve: Any = None,
    cor_speeds: Any = None,
    *,
    law: int = 2,
    exponent: float | str = 1.0,
    reference_compression: float = 0.005,
    csv: Path | None = None,
    columns: str = "",
    predict: Sequence[float] | None = None,
    progress: Callable[[float, str], object] = lambda percent, title: None,
    **scalars: float | None,
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
        columns: heads or numbers of time, force and σ in files of curves, as "t [ms],F [kN]".
        predict: club speeds to predict S, COR and ball speed at, m/s.
        progress: called now and then with the progress in per cent and a law's title.
        scalars: ball_speed, club_speed_after, cor, contact_time, max_force, time_of_max_force, and
            the σ of each (1 % of it by default) as sigma_ball_speed and so on; club_speed (35 m/s),
            m_club (0.210 kg), m_ball (0.04593 kg) and club_force (0 N) of them and the curve.

    Raises:
        UserError: measurements are impossible or too few, or SciPy is missing.
    """
    chosen = ContactLaw.of(law, exponent, reference_compression)
    data = measurements(scalars, csv, curve, cor_speeds, columns)
    try:
        speeds = None if predict is None else [number(one, "predict") for one in predict]
        return Calibration(data, chosen, speeds, progress)
    except ImportError:
        raise missing_package("calibrate", "SciPy", "calibrate") from None
