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
from golf_impact.api import run_impacts
from golf_impact.ball import Ball, ball_toml
from golf_impact.calibration.fit import ContactLaw, Estimate, Fit, chance_of
from golf_impact.calibration.intervals import standard_errors
from golf_impact.calibration.measurements import (
    BASELINES,
    DEFAULT_SIGMA,
    IMPACT,
    LAW_PARAMETERS,
    TARGETS,
    Measurements,
    measurements,
    number,
)
from golf_impact.errors import UserError
from golf_impact.files import write
from golf_impact.quantities import (
    QUANTITIES,
    Quantity,
    format_options,
    format_unit,
    format_with_error,
)
from golf_impact.units import unit_of

#: What is worth a sentence: a χ² that law and σ exceed less often than this, a lag-1
#: autocorrelation of a curve's residuals, times √rows, above this, an AIC lower by this.
_UNLIKELY, _CORRELATED, _BETTER = 0.01, 4.0, 2.0

#: Kelvin–Voigt, absolute, Tsuji and free n, which every calibration is compared with.
_COMPARED = ((2, 1.0), (1, 1.0), (2, 1.5), (2, None))

#: What is predicted at other club speeds.
_PREDICTED = ("smash_factor", "coefficient_of_restitution", "ball_velocity")

#: Symbols in the text.
_SYMBOLS = {
    "exponent": "n",
    "restitution_at_rest": "COR at zero speed",
    "restitution_slope": "slope",
}


class Interval(NamedTuple):
    """Predictions with their 95 % intervals, arrays of one shape."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Table(NamedTuple):
    """Rows of text."""

    title: str
    columns: list[str]
    rows: list[list[str]]


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
        baselines: of each curve the sensor's offset and drift in its rows, N.
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
        self.residuals = {
            n: best.residuals[rows] for n, rows in data.groups.items() if n != "priors"
        }
        self.baselines = {name: best.baseline(name, one) for name, one in data.curves.items()}
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
            at = f" ({_in_words(one.impact)})" if one.impact else ""
            names.append(f"{len(one.y)} rows of {one.name}{at}")
        measured = ", ".join(names)
        if data.targets or not data.curves:
            measured += f"; {_in_words(data.impact)}"
        # The impact isn't part of the ball, but for a mass of its own.
        of_ball = {*fit.values}.difference(IMPACT)
        if fit.values["m_ball"] != IMPACT["m_ball"]:
            of_ball.add("m_ball")
        conditions = {n: fit.values[n] for n in IMPACT if n != "m_ball" and fit.values[n]}
        known = [n for n in self.parameters if n in LAW_PARAMETERS and n not in self._limits]
        at = [[*self.parameters].index(name) for name in known]
        return Ball(
            name="calibrated",
            title=f"calibrated, {fit.title}",
            values={name: v for name, v in fit.values.items() if name in of_ball},
            source=f"golf-impact calibrate: {measured}",
            uncertain=tuple(known),
            covariance=tuple(map(tuple, self.covariance[np.ix_(at, at)].tolist())),
            conditions=conditions,
            limits="; ".join(self._limits.values()),
        )

    @property
    def _limits(self) -> dict[str, str]:
        """Parameters at their limit, and what follows of them, in words."""
        found = {}
        for name, one in self.parameters.items():
            if one.limit is not None:
                low, high = one.interval
                ends = f"at most {high:.3g}" if one.limit == low else f"at least {low:.3g}"
                found[name] = f"{name} is at its limit {one.limit:g}, {ends} {_unit(name)}".rstrip()
        return found

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
        return self.fit.fit_report()

    def draw(self) -> Any:
        """The figure, a `matplotlib.figure.Figure`: data, fit with 95 % bands, and residuals."""
        from golf_impact.calibration.figure import draw

        return draw(self)

    def __repr__(self) -> str:
        found = [f"  {name} = {text}" for name, text, _ in self.tables()[0].rows]
        freedom = f"degrees of freedom {self.degrees_of_freedom}"
        title = f"Calibration: {self.fit.title} (law {self.fit.law.law})"
        return "\n".join([title, *found, f"  χ² = {_chi(self.chi_squared)}, {freedom}"])

    @property
    def words(self) -> list[str]:
        """What the numbers say, in sentences."""
        best, data, words = self.fit, self.data, []
        for text in self._limits.values():
            name, _, end = text.partition(", ")
            words.append(
                f"{name}: check club speed and mass. It has no standard error; it is {end} (95 %)."
            )
        if default := [name for name, one in data.targets.items() if not one.stated]:
            words.append(f"σ is taken as {DEFAULT_SIGMA * 100:g} % of {', '.join(default)}.")
        for name, curve in data.curves.items():
            words += [f"{curve.name}: {note}." for note in (*curve.notes, self._baseline(name))]
        for name in best.estimated:
            sigma = best.sigma[data.groups[name]][0]
            what = f"σ of {data.series[name].name}, {sigma:.3g}, follows from its residuals"
            words.append(f"{what}; so χ² doesn't test the law.")
        chance, freedom = best.probability, best.degrees_of_freedom
        square = f"χ² = {_chi(best.chi_squared)} with {freedom} degrees of freedom"
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
        words += self._compared_stiffnesses()
        better = min((best, *self.fits), key=lambda other: other.aic)
        if best.aic - better.aic > _BETTER and not best.is_exact:
            lower = f"its AIC is lower by {best.aic - better.aic:.3g}"
            words.append(f"{better.title} describes these measurements better: {lower}.")
        names = [_SYMBOLS.get(name, name) for name in self.parameters]
        pairs = [
            f"C({names[m]}, {names[n]}) = {best.correlations[m, n]:.2f}".replace("-", "−")
            for m, n in itertools.combinations(range(len(names)), 2)
            if best.correlations[m, n]
        ]
        if pairs:
            words.append(f"Correlations: {', '.join(pairs)}.")
        return words

    def _baseline(self, name: str) -> str:
        """What is subtracted from a curve, in words."""
        curve, found = self.data.curves[name], self.fit.curves[name]
        kind = BASELINES[len(curve.baseline)]
        if kind == "zero":
            return "baseline zero: its rows before and after contact show no offset"
        level = f"an offset of {format_with_error(*found['offset'][:2])} N"
        if kind == "constant":
            return f"baseline constant: {level} is subtracted"
        length = float(np.ptp(curve.x))
        drift = format_with_error(*(length * part for part in found["drift"][:2]))
        return f"baseline linear: {level} at touch and a drift of {drift} N over the record are subtracted"

    def _compared_stiffnesses(self) -> list[str]:
        if not self.apart:
            return []
        values = [one.value for one in self._stiffnesses().values()]
        spread = 100.0 * (max(values) - min(values)) / self.parameters["k"].value
        gain = self.fit.deviance - self.apart.deviance
        chance = chance_of(gain, len(values) - 1)
        often = [times for times in (20, 100, 1000) if chance < 1.0 / times]
        least = f"Stiffnesses of the curves differ by {spread:.2g} %"
        if not often:
            return [f"{least}, no more than by chance: one describes all of them."]
        exact = "club speeds and masses count as exact"
        return [f"{least}, more than chance in 1 of {often[-1]} ({exact})."]

    def tables(self) -> list[Table]:
        """Parameters, measurements, predictions, and the comparison of laws."""
        best, data = self.fit, self.data
        found = dict(self.parameters)
        for name, one in best.curves.items():
            found |= {f"{of}{name.removeprefix('curve')}": value for of, value in one.items()}
        parameters = []
        for name, one in found.items():
            unit = _unit(name)
            text = f"{one.value:.6g} (at its limit)"
            if one.limit is None:
                text = format_with_error(one.value, one.standard_error)
            ends = " to ".join(f"{end:.6g}" for end in one.interval)
            parameters.append([name, f"{text} {unit}".rstrip(), ends])
        rows = []
        for (name, target), residual in zip(data.targets.items(), best.residuals):
            one = QUANTITIES.get(TARGETS[name], Quantity(TARGETS[name], decimals=6))
            numbers = map(one.format_value, (target.value, best.predicted[name]))
            measured, model = numbers
            rows.append(
                [
                    one.label,
                    measured,
                    f"{target.sigma * one.factor:.2g}",
                    model,
                    _residual(residual),
                ]
            )
        for name, series in data.series.items():
            rms = f"rms {np.sqrt(np.mean(self.residuals[name] ** 2)):.2f}"
            if series.impact:
                rms += f" ({best.rms[name]:.3g} N), {series.impact['club_speed']:g} m/s"
            sigma = f"{np.mean(best.sigma[data.groups[name]]):.3g}"
            rows.append([series.name, f"{len(series.y)} rows", sigma, "", rms])
        for (name, prior), residual in zip(
            data.priors.items(), best.residuals[data.groups["priors"]]
        ):
            model = f"{best.values[name]:.6g}"
            rows.append(
                [
                    f"prior {name}",
                    f"{prior.value:.6g}",
                    f"{prior.sigma:.2g}",
                    model,
                    _residual(residual),
                ]
            )
        speeds = []
        for n, speed in enumerate(self.speeds):
            cells = [f"{speed:g}"]
            for one in self.predictions.values():
                value, low, high = (part[n] for part in one)
                symmetric = math.isclose(high - value, value - low, rel_tol=1e-6)
                cells.append(
                    format_with_error(value, high - value)
                    if symmetric
                    else f"{value:.4g} ({low:.4g} to {high:.4g})"
                )
            speeds.append(cells)
        # Nothing is ranked by rounding.
        ranked = [one.aic for one in self.fits if not one.is_exact]
        exact, laws = len(ranked) < len(self.fits), []
        for law in self.fits:
            values = ", ".join(f"{name} = {v.value:.4g}" for name, v in law.parameters.items())
            sizes = [f"{law.rms[name]:.4g}" for name in data.curves] or [_chi(law.chi_squared)]
            delta = "exact" if law.is_exact else "–" if exact else f"{law.aic - min(ranked):.4g}"
            laws.append([law.law.title, values, ", ".join(sizes), delta])
        size = "rms residual (N)" if data.curves else "χ²"
        square = f"χ² = {_chi(best.chi_squared)}, degrees of freedom {best.degrees_of_freedom}"
        at = f"{len(data.curves)} curves" if self.apart else _in_words(data.impact)
        heads = ["", "measured", "σ", "model", "residual (σ)"]
        labels = ["club speed (m/s)", *(QUANTITIES[name].label for name in _PREDICTED)]
        alone = {"all": self.parameters["k"], **self._stiffnesses()} if self.apart else {}
        stiffnesses = [[name, format_with_error(*one[:2])] for name, one in alone.items()]
        title = f"{best.title} (law {best.law.law})"
        tables = [
            Table(title, ["", "value ± standard error", "95 % interval"], parameters),
            Table(f"Measurements, {at}: {square}", heads, rows),
            Table("Predictions with 95 % intervals, if the law holds", labels, speeds),
            Table("Contact laws compared", ["", "parameters", size, "ΔAIC"], laws),
            Table("Stiffness by curve", ["", "k (N/m)"], stiffnesses),
        ]
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
        series = {}
        for name, one in data.series.items():
            series[name] = {
                "name": one.name,
                "rows": len(one.y),
                "sigma_given": one.sigma is not None,
            }
            series[name]["sigma"] = float(np.mean(best.sigma[data.groups[name]]))
            if own := best.curves.get(name):
                series[name] |= {
                    "conditions": dict(one.impact),
                    "touch_time": own["touch"].as_json(),
                    "baseline": BASELINES[len(one.baseline)],
                    **{of: own[of].as_json() for of in ("offset", "drift") if of in own},
                }
        predictions: list[dict[str, Any]] = [{"club_speed": v} for v in self.speeds.tolist()]
        for name, interval in self.predictions.items():
            for row, *ends in zip(predictions, *(part.tolist() for part in interval)):
                row[name] = dict(zip(Interval._fields, ends))
        return {
            "version": VERSION,
            "command": self.command,
            "conditions": {name: best.values[name] for name in IMPACT},
            **best.as_json(),
            "touch_time": series["curve"]["touch_time"] if data.curves else None,
            "targets": targets,
            "series": series,
            "priors": {name: one._asdict() for name, one in data.priors.items()},
            "predictions": predictions,
            "notes": self.words,
            "comparison": [one.as_json() for one in self.fits],
            "stiffness_by_curve": {n: one.as_json() for n, one in self._stiffnesses().items()},
        }


def _in_words(impact: Mapping[str, float]) -> str:
    """The impact in which scalars or a curve were measured."""
    words = "{club_speed:g} m/s, club {m_club:g} kg, ball {m_ball:g} kg".format(**impact)
    return words + (f", head pushed by {impact['club_force']:g} N" if impact["club_force"] else "")


def _unit(name: str) -> str:
    of = name.split("_")[0]
    of_curve = {"touch": "s", "offset": "N", "drift": "N/s"}
    return of_curve.get(of) or format_unit(unit_of(of if of == "k" else name))


def _chi(square: float) -> str:
    """χ² in text; what is left of an exact fit is rounding."""
    return f"{square:.4g}" if square >= 1e-4 else "0"


def _residual(value: float) -> str:
    return f"{value:+.2f}" if abs(value) >= 0.005 else "0.00"


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
    if other := [name for name in fixed if name not in LAW_PARAMETERS]:
        raise UserError(f"fix {other[0]} is refused: choose from n, {', '.join(LAW_PARAMETERS)}")
    fixed = {name: number(value, name, "fix") for name, value in fixed.items()}
    chosen = ContactLaw.of(law, fixed.pop("exponent", exponent), reference_compression)
    priors = {name if name != "n" else "exponent": value for name, value in (prior or {}).items()}
    data = measurements(scalars, csv, curve, cor_speeds, columns, baseline, priors)
    speeds = None if predict is None else [number(one, "predict") for one in predict]
    return Calibration(data, chosen, speeds, progress, fixed, profile)
