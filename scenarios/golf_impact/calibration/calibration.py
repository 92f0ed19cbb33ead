"""The result of a calibration: the fit, other laws beside it, predictions, and a ball of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from golf_build import VERSION
from golf_impact.calibration import measurements as measured
from golf_impact.calibration.fit import Fit, fit, missing
from golf_impact.calibration.measurements import TARGETS, Measurements, option
from golf_impact.calibration.model import ContactLaw
from golf_impact.calibration.pulse import contact_rows
from golf_impact.errors import UserError, lacking
from golf_impact.facts.balls import Ball, ball_toml
from golf_impact.facts.quantities import QUANTITIES, set_options, with_error
from golf_impact.files import prepare, write_together
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.fmu.uncertainty import standard_errors
from golf_impact.report.outcome import Table

#: A χ² that law and σ would exceed less often than this is a misfit.
_UNLIKELY = 0.01

#: Residuals of a curve are correlated if their lag-1 autocorrelation, times √rows, exceeds this.
_CORRELATED = 4.0

#: An AIC lower by this is worth a sentence.
_BETTER = 2.0

#: Parameters with their units, as tables show them.
_UNITS = {
    "k": ("k", "N/m"),
    "b": ("b", "N·s/m"),
    "exponent": ("exponent n", ""),
    "restitution_at_rest": ("COR at zero speed", ""),
    "restitution_slope": ("slope −dCOR/dv", "s/m"),
}

#: Targets as tables show them.
_QUANTITIES = {
    name: QUANTITIES[output]._replace(name=text, symbol="")
    for name, (output, text, _) in TARGETS.items()
}

#: Every calibration is compared with Kelvin–Voigt, absolute, Tsuji and free n.
_COMPARED = ((2, 1.0), (1, 1.0), (2, 1.5), (2, None))

#: What is predicted at other club speeds.
PREDICTED = ("smash_factor", "coefficient_of_restitution", "ball_velocity")


class Estimate(NamedTuple):
    """A parameter in SI units; the standard error is None where it isn't defined."""

    value: float
    standard_error: float | None


class Interval(NamedTuple):
    """Predictions with their 95 % intervals, arrays of one shape; NaN where not defined."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Calibration:
    """A contact law fitted to measurements, beside other laws.

    Attributes:
        data: the measurements.
        fit: all of the fit, with arrays over the measured values.
        compared: other laws with their fits, or why there is none.
        speeds: club speeds of the predictions, m/s.
        predictions: S, COR and ball speed there, see `predict`.
        paths: time since touch (s) and force (N) of each fit, by its title.
    """

    def __init__(
        self,
        fmu: ImpactFmu,
        data: Measurements,
        law: ContactLaw,
        speeds: Sequence[float] | None = None,
    ) -> None:
        self.data, self._path = data, fmu.path
        self.fit = fit(fmu, data, law)
        self.compared: list[tuple[ContactLaw, Fit | str]] = []
        for number, exponent in _COMPARED if data.sized else ():
            other = ContactLaw(number, exponent, law.reference_compression)
            result: Fit | str = self.fit
            if why := missing(other, data):
                result = why
            elif other != law:
                try:
                    result = fit(fmu, data, other)
                except UserError as error:
                    result = str(error)
            self.compared.append((other, result))
        if speeds is None:
            one = data.cor_speeds
            middle = data.conditions.club_speed if one is None else float(np.mean(one.x))
            speeds = [float(f"{middle * factor:.2g}") for factor in (0.6, 0.8, 1.0, 1.2, 1.4)]
        self.speeds = np.array(speeds, float)
        self.predictions = self._predict(fmu, self.speeds)
        self.paths = {
            one.title: fmu.trajectory(301, ("force",), **one.values)
            for one in (self.fit, *self.fits)
            if data.sized
        }

    # Results

    @property
    def fits(self) -> list[Fit]:
        """The laws compared, as far as they could be fitted."""
        return [one for _, one in self.compared if isinstance(one, Fit)]

    @property
    def parameters(self) -> dict[str, Estimate]:
        """The fitted parameters by their FMU names, in the order of `covariance`."""
        return {n: Estimate(self.fit.values[n], e) for n, e in self.fit.standard_errors.items()}

    @property
    def covariance(self) -> np.ndarray:
        """Of the parameters, (p, p); NaN where not defined."""
        return self.fit.covariance

    @property
    def chi_squared(self) -> float:
        return self.fit.chi_squared

    @property
    def degrees_of_freedom(self) -> int:
        return self.fit.degrees_of_freedom

    @property
    def residuals(self) -> dict[str, np.ndarray]:
        """(model − measured)/σ of `targets`, `curve` and `cor_speeds`."""
        return {name: self.fit.residuals[rows] for name, rows in self.data.groups.items()}

    def predict(self, club_speeds: float | Sequence[float] | np.ndarray) -> dict[str, Interval]:
        """S, COR and ball speed (m/s) at other club speeds, with 95 % intervals.

        The intervals follow from the covariance of the parameters, linearly; they hold if the law
        does.

        Args:
            club_speeds: m/s, an array of any shape.

        Raises:
            UserError: the FMU refuses a speed.
        """
        with ImpactFmu(self._path) as fmu:
            return self._predict(fmu, np.asarray(club_speeds, float))

    def _predict(self, fmu: ImpactFmu, speeds: np.ndarray) -> dict[str, Interval]:
        def evaluate(values: Mapping[str, float]) -> np.ndarray:
            cases = ({**values, "club_speed": speed} for speed in speeds.ravel().tolist())
            rows = [list(fmu.impact(PREDICTED, **case).values()) for case in cases]
            return np.array(rows).T.reshape(len(PREDICTED), *speeds.shape)

        names, covariance = self._uncertain()
        value = evaluate(self.fit.values)
        half = np.full(value.shape, math.nan)
        if names:
            errors = standard_errors(evaluate, self.fit.values, names, covariance)
            half = self.fit.coverage * errors
        intervals = map(Interval, value, value - half, value + half)
        return dict(zip(PREDICTED, intervals, strict=True))

    def _uncertain(self) -> tuple[list[str], np.ndarray]:
        """Parameters that have a standard error, and their covariance."""
        defined = np.flatnonzero(np.isfinite(np.diag(self.covariance)))
        return [self.fit.free[n] for n in defined], self.covariance[np.ix_(defined, defined)]

    @property
    def ball(self) -> Ball:
        """The ball that was found; `**ball.values` are inputs and parameters of the FMU."""
        impact, names = self.data.conditions, [option(name) for name in self.data.targets]
        names += [f"{len(one.y)} rows of {one.name}" for one in self.data.series.values()]
        # The impact isn't part of the ball, but for a mass of its own.
        apart = {"club_speed", "m_club"}
        apart |= {"m_ball"} if impact.m_ball == measured.Conditions.m_ball else set()
        uncertain, covariance = self._uncertain()
        return Ball(
            name="calibrated",
            title=f"calibrated, {self.fit.title}",
            values={name: v for name, v in self.fit.values.items() if name not in apart},
            source=f"golf-impact calibrate: {', '.join(names)}; {_conditions(impact)}",
            uncertain=tuple(uncertain),
            covariance=tuple(map(tuple, covariance.tolist())),
        )

    def save(self, path: Path | str) -> Path:
        """Write the ball as a TOML file, for `--ball FILE.toml` and `golf_impact.read_ball`.

        Raises:
            UserError: the name doesn't end in .toml, or the file can't be written.
        """
        path = check_save(Path(path))
        return write_together(path.parent, {path.name: ball_toml(self.ball).encode()})[0]

    @property
    def command(self) -> str:
        """The command line that reproduces the impact with all results printed of it."""
        default = vars(measured.Conditions())
        pairs = {n: v for n, v in self.fit.values.items() if default.get(n) != v}
        return f"golf-impact run {set_options(pairs)}"

    def __repr__(self) -> str:
        lines = [f"Calibration: {self.fit.title} (law {self.fit.law.law})"]
        for name, estimate in self.parameters.items():
            lines.append(f"  {name} = {with_error(*estimate)} {_UNITS[name][1]}".rstrip())
        lines.append(f"  χ² = {self.chi_squared:.3f}, degrees of freedom {self.degrees_of_freedom}")
        return "\n".join(lines)

    # In words

    @property
    def words(self) -> list[str]:
        """What the numbers say, in sentences."""
        best, data, chance = self.fit, self.data, self.fit.probability
        words = [f"{note[0].upper()}{note[1:]}." for note in best.notes]
        for other in best.others:
            values = ", ".join(f"{name} = {other[name]:.6g}" for name in best.free)
            words.append(f"These parameters meet the measurements equally well: {values}.")
        if not data.sized:
            words.append("COR alone doesn't determine k and n: add a curve, a time or a force.")
        default = [option(t.name) for t in data.targets.values() if not t.stated]
        if default:
            words.append(
                f"σ is taken as {measured.DEFAULT_SIGMA * 100:g} % of {', '.join(default)} (none "
                "was given); standard errors and χ² follow from it."
            )
        for name in best.estimated:
            sigma, unit = best.sigma[data.groups[name]][0], " N" if name == "curve" else ""
            words.append(
                f"σ of {data.series[name].name} follows from its residuals: {sigma:.3g}{unit}; so "
                "χ² is close to the degrees of freedom for any law and doesn't test it."
            )
        freedom, square = best.degrees_of_freedom, f"χ² = {best.chi_squared:.3g}"
        if chance is not None and chance < _UNLIKELY:
            words.append(
                f"This law doesn't fit: {square} with {freedom} degrees of freedom (probability "
                f"{chance:.1g}). The law is wrong, σ is too small, or measurements contradict each "
                "other."
            )
        elif chance is not None:
            words.append(
                f"{square} with {freedom} degrees of freedom is compatible with law and σ "
                f"(probability of a larger one: {chance:.2g})."
            )
        elif freedom <= 0 and best.chi_squared > 1e-4:
            words.append(
                f"{best.title} can't meet these targets together ({square}); the fit comes nearest "
                "to them, and standard errors are those of the σ alone."
            )
        elif freedom <= 0:
            words.append(
                f"As many targets as parameters: {best.title} meets them exactly, so χ² doesn't "
                "test the law; standard errors are those of the σ alone."
            )
        value, significance = self.correlation
        if significance > _CORRELATED:
            words.append(
                f"Neighbouring residuals of the curve are correlated ({value:.2f}): the law misses "
                "its shape, or its noise is correlated; standard errors are too small."
            )
        better = min((best, *self.fits), key=lambda other: other.aic)
        if best.aic - better.aic > _BETTER:
            words.append(
                f"{better.title} describes these measurements better: its AIC is lower by "
                f"{best.aic - better.aic:.3g}. Try {better.law.options}."
            )
        return words

    @property
    def correlation(self) -> tuple[float, float]:
        """Lag-1 autocorrelation of the curve's residuals in contact, and times √rows; 0 if none."""
        if self.data.curve is None:
            return 0.0, 0.0
        residuals = self.residuals["curve"][contact_rows(self.data.curve.y)]
        value = float(residuals[1:] @ residuals[:-1]) / max(float(residuals @ residuals), 1e-300)
        return value, value * math.sqrt(len(residuals))

    # Tables

    def tables(self) -> list[Table]:
        """Parameters, measurements, predictions, and the comparison of laws."""
        best, data = self.fit, self.data
        found = [[_label(n), with_error(*one)] for n, one in self.parameters.items()]
        if best.touch[1] is not None:
            touch = with_error(best.touch[0] * 1e6, best.touch[1] * 1e6)
            found.append(["touch, by the curve's clock (µs)", touch])
        rows = []
        for name, model in best.predicted.items():
            target, cells = data.targets.get(name), ["", "", _shown(name, model), "predicted"]
            if target:
                off = (model - target.value) / target.sigma
                cells[:2] = _shown(name, target.value), _shown(name, target.sigma, 2)
                cells[3] = f"{off:+.2f}"
            rows.append([_QUANTITIES[name].label, *cells])
        for name, one in data.series.items():
            at = data.groups[name]
            rms, sigma = np.sqrt(np.mean(best.residuals[at] ** 2)), np.mean(best.sigma[at])
            label = "force curve (N)" if name == "curve" else "COR over speed"
            rows.append([label, f"{len(one.y)} rows", f"{sigma:.3g}", "", f"rms {rms:.2f}"])
        speeds = []
        for n, speed in enumerate(self.speeds):
            cells = [f"{speed:g}"]
            for value, _, high in (self.predictions[name] for name in PREDICTED):
                half = high[n] - value[n]
                cells.append(with_error(value[n], half if half == half else None))
            speeds.append(cells)
        freedom, impact = best.degrees_of_freedom, _conditions(data.conditions)
        title = f"Measurements, {impact}: χ² = {best.chi_squared:.4g}, degrees of freedom {freedom}"
        heads = ["club speed (m/s)", *(QUANTITIES[name].label for name in PREDICTED)]
        tables = [
            Table(f"{best.title} (law {best.law.law})", ["", "value ± standard error"], found),
            Table(title, ["", "measured", "σ", "model", "residual (σ)"], rows),
            Table("Predictions with 95 % intervals, valid if the law is", heads, speeds),
        ]
        return [*tables, self._comparison()] if self.fits else tables

    def _comparison(self) -> Table:
        least = min(one.aic for one in self.fits)
        names = list(dict.fromkeys(name for one in self.fits for name in one.free))
        labels = [*map(_label, names), "χ²", "degrees of freedom", "AIC − least AIC"]
        labels += [f"σ of {self.data.series[name].name}" for name in self.fit.estimated]
        labels += [one.label for one in _QUANTITIES.values()]
        columns = []
        for one in self.fits:
            cells = [f"{one.values[n]:.4g}" if n in one.values else "" for n in names]
            cells += [f"{one.chi_squared:.3g}", f"{one.degrees_of_freedom}"]
            cells += [f"{one.aic - least:.3g}"]
            cells += [f"{one.sigma[self.data.groups[name]][0]:.3g}" for name in one.estimated]
            columns.append(cells + [_shown(name, one.predicted[name], 4) for name in TARGETS])
        rows = [list(row) for row in zip(labels, *columns, strict=True)]
        return Table("Contact laws compared", ["", *(one.law.title for one in self.fits)], rows)

    # Files

    def as_json(self) -> dict[str, Any]:
        """All of it, for calibrate.json (SI units); null where something isn't defined."""
        best, data = self.fit, self.data
        series = {
            name: {
                "name": one.name,
                "rows": len(one.y),
                "sigma": float(np.mean(best.sigma[data.groups[name]])),
                "sigma_given": name not in best.estimated,
            }
            for name, one in data.series.items()
        }
        targets = [
            {
                **{"name": name, "target": target.value, "sigma": target.sigma},
                **{"sigma_given": target.stated, "model": best.predicted[name]},
                "residual": (best.predicted[name] - target.value) / target.sigma,
            }
            for name, target in data.targets.items()
        ]
        predictions = [
            {"club_speed": speed}
            | {
                name: {part: values[n] for part, values in one._asdict().items()}
                for name, one in self.predictions.items()
            }
            for n, speed in enumerate(self.speeds.tolist())
        ]
        comparison = [
            {"title": law.title, "law": law.law, "exponent": law.exponent}
            | ({"not_fitted": one} if isinstance(one, str) else one.as_json())
            for law, one in self.compared
        ]
        return {
            **{"version": VERSION, "command": self.command, "law": best.law.law},
            **{"title": best.title, **best.as_json()},
            "touch_time": Estimate(*best.touch)._asdict() if data.curve else None,
            "fixed": {n: v for n, v in best.values.items() if n not in best.free},
            **{"targets": targets, "series": series, "predictions": predictions},
            "residual_correlation": self.correlation[0] if data.curve else None,
            **{"other_solutions": best.others, "notes": self.words, "comparison": comparison},
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
    club_speed: float | None = None,
    m_club: float | None = None,
    m_ball: float | None = None,
    csv: Path | None = None,
    predict: Sequence[float] | None = None,
    **scalars: float | None,
) -> Calibration:
    """Fit a contact law to measurements of an impact on a ball at rest, all together (SI units).

    Args:
        curve: a measured force curve with an unknown instant of touch: `(time, force)` or `(time,
            force, sigma)`, arrays in s and N, a mapping (or data frame) of these columns, or a CSV
            file of them.
        cor_speeds: likewise `(approach_speed, cor[, sigma])`; fits restitution_at_rest and
            restitution_slope in place of b.
        law: 1 (absolute) or 2 (relative).
        exponent: n of law 2's power law, or "free" to fit it too.
        reference_compression: at which k and b hold, m.
        club_speed: of curve and scalars, m/s (35 by default).
        m_club: kg (0.210 by default).
        m_ball: kg (0.04593 by default).
        csv: a CSV file of scalars with the columns target,value,sigma.
        predict: club speeds to predict S, COR and ball speed at, m/s.
        scalars: ball_speed, club_speed_after, cor, contact_time, max_force, time_of_max_force, and
            the σ of each (1 % of it by default) as sigma_ball_speed and so on.

    Returns:
        Parameters, covariance, χ², residuals, predictions, the ball.

    Raises:
        UserError: measurements are impossible or too few, or SciPy is missing.
    """
    sigmas = {name: f"sigma_{name}" for name in TARGETS}
    if unknown := set(scalars) - {*sigmas, *sigmas.values()}:
        raise UserError(f"there is no target {min(unknown)!r}: choose from {', '.join(sigmas)}")
    chosen = ContactLaw.of(law, exponent, reference_compression)
    data = measured.measurements(
        {name: (scalars.get(name), scalars.get(sigma)) for name, sigma in sigmas.items()},
        {"club_speed": club_speed, "m_club": m_club, "m_ball": m_ball},
        *(csv, curve, cor_speeds),
    )
    check(data, chosen)
    try:
        import scipy  # noqa: F401
    except ImportError:
        raise lacking("calibrate", "SciPy", "calibrate") from None
    with ImpactFmu(current_fmu()[0]) as fmu:
        return Calibration(fmu, data, chosen, predict)


def check(data: Measurements, law: ContactLaw) -> None:
    """Raise UserError for measurements that are too few or impossible together."""
    if not data.targets and not data.series:
        raise UserError(
            "calibrate needs measurements: --curve FILE.csv, --cor-speeds FILE.csv or at least two "
            "targets, e.g. golf-impact calibrate --cor 0.743 --contact-time 600e-6; there are "
            f"{', '.join(map(option, TARGETS))}"
        )
    measured.check_together(data, law.law)
    if why := missing(law, data):
        raise UserError(f"{law.title} can't be fitted: {why}")


def check_save(path: Path) -> Path:
    """A path that a ball can be saved to; UserError if it can't."""
    if path.suffix != ".toml":
        raise UserError(f"--save {path} is refused: the name of a ball's file must end in .toml")
    prepare(path.parent, path.name)
    return path


def _label(name: str) -> str:
    symbol, unit = _UNITS[name]
    return f"{symbol} ({unit})" if unit else symbol


def _shown(name: str, value: float, digits: int = 5) -> str:
    return f"{value * _QUANTITIES[name].factor:.{digits}g}"


def _conditions(impact: measured.Conditions) -> str:
    return f"{impact.club_speed:g} m/s, club {impact.m_club:g} kg, ball {impact.m_ball:g} kg"
