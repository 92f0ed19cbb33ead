"""The result of a calibration: the fit, other laws beside it, predictions, and a ball of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from golf_build import VERSION
from golf_impact.calibration import measurements as measured
from golf_impact.calibration.fit import Fit, fit, missing
from golf_impact.calibration.measurements import TARGETS, Measurements, contact_rows, option
from golf_impact.calibration.model import ContactLaw
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

#: An AIC lower by this is worth a word.
_BETTER = 2.0

#: Parameters with their units, as tables show them.
PARAMETERS = {
    "k": "k (N/m)",
    "b": "b (N·s/m)",
    "exponent": "exponent n",
    "restitution_at_rest": "COR at zero speed",
    "restitution_slope": "slope −dCOR/dv (s/m)",
}

#: Targets as tables show them.
_SHOWN = {
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
    """Predictions with their 95 % intervals, arrays of one shape."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Calibration:
    """A contact law fitted to measurements, beside other laws.

    Attributes:
        data: the measurements.
        fit: all of the fit, with arrays over the measured values.
        compared: other laws with their fits, or why there is none.
        predictions: S, COR and ball speed at the club speeds `speeds`, see `predict`.
    """

    def __init__(
        self,
        fmu: ImpactFmu,
        data: Measurements,
        law: ContactLaw,
        speeds: Sequence[float] | None = None,
    ) -> None:
        self.data, self.law = data, law
        self._path = fmu.path
        self.fit = fit(fmu, data, law)
        self.compared: list[tuple[ContactLaw, Fit | str]] = []
        for number, exponent in _COMPARED if data.sized else ():
            other = ContactLaw(number, exponent, law.reference_compression)
            result: Fit | str = self.fit
            if number == 1 and data.cor_speeds is not None:
                result = "has no COR line"
            elif missing(other, data):
                result = f"needs {2 + (exponent is None)} independent targets"
            elif other != law:
                try:
                    result = fit(fmu, data, other)
                except UserError as error:
                    result = str(error)
            self.compared.append((other, result))
        middle = data.conditions.club_speed
        if data.cor_speeds is not None:
            middle = 0.5 * float(data.cor_speeds.x.min() + data.cor_speeds.x.max())
        around = [float(f"{middle * factor:.2g}") for factor in (0.6, 0.8, 1.0, 1.2, 1.4)]
        self.speeds = np.array(around if speeds is None else speeds, float)
        self.predictions = self._predict(fmu, self.speeds)
        #: Time since touch (s) and force (N) of each fit, by its law's title.
        self.paths: dict[str, dict[str, np.ndarray]] = {}
        for one in (self.fit, *(one for _, one in self.compared)):
            if data.sized and isinstance(one, Fit):
                self.paths[one.law.title] = fmu.trajectory(names=("force",), **one.values)

    # Results

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
            rows = [
                fmu.impact(PREDICTED, **{**values, "club_speed": speed})
                for speed in speeds.ravel().tolist()
            ]
            shape = (len(PREDICTED), *speeds.shape)
            return np.array([[row[name] for row in rows] for name in PREDICTED]).reshape(shape)

        names, covariance = self._uncertain()
        value = evaluate(self.fit.values)
        half = np.full(value.shape, math.nan)
        if names:
            errors = standard_errors(evaluate, self.fit.values, names, covariance)
            half = self.fit.coverage * errors
        return {
            name: Interval(value[n], value[n] - half[n], value[n] + half[n])
            for n, name in enumerate(PREDICTED)
        }

    def _uncertain(self) -> tuple[list[str], np.ndarray]:
        """Independent parameters with a standard error, and their covariance."""
        free = list(self.fit.free)
        errors = self.fit.standard_errors
        names = [n for n in free if errors[n] is not None]
        at = [free.index(name) for name in names]
        return names, self.fit.covariance[np.ix_(at, at)]

    @property
    def ball(self) -> Ball:
        """The ball that was found; `**ball.values` are inputs and parameters of the FMU."""
        default, conditions = measured.Conditions(), self.data.conditions
        leave_out: tuple[str, ...] = ("club_speed", "m_club")
        if conditions.m_ball == default.m_ball:
            leave_out += ("m_ball",)
        values = {name: v for name, v in self.fit.values.items() if name not in leave_out}
        given = [option(name) for name in self.data.targets]
        given += [f"{len(one.y)} rows of {one.name}" for one in self.data.series.values()]
        source = f"golf-impact calibrate: {', '.join(given)}, club speed {conditions.club_speed:g} "
        names, covariance = self._uncertain()
        return Ball(
            name="calibrated",
            title=f"calibrated, {self.fit.law.title}",
            values=values,
            source=f"{source}m/s, club {conditions.m_club:g} kg, ball {conditions.m_ball:g} kg",
            uncertain=tuple(names),
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
        """The command line that reproduces the impact, and all of its printed results."""
        default = vars(measured.Conditions())
        pairs = {n: v for n, v in self.fit.values.items() if default.get(n) != v}
        return f"golf-impact run {set_options(pairs)}"

    def __repr__(self) -> str:
        width = max(map(len, self.parameters))
        lines = [f"Calibration: {self.fit.law.title} (law {self.fit.law.law})"]
        for name, (value, error) in self.parameters.items():
            unit = PARAMETERS[name].partition("(")[2].rstrip(")")
            lines.append(f"  {name:<{width}} = {with_error(value, error)} {unit}".rstrip())
        freedom = self.degrees_of_freedom
        lines.append(f"  χ² = {self.chi_squared:.4g}, degrees of freedom {freedom}")
        return "\n".join(lines)

    # In words

    @cached_property
    def words(self) -> list[str]:
        """What the numbers say, in sentences."""
        best, data = self.fit, self.data
        words = [f"{note[0].upper()}{note[1:]}." for note in best.notes]
        for other in best.others:
            values = ", ".join(f"{name} = {other[name]:.6g}" for name in best.free)
            words.append(f"These parameters meet the measurements equally well: {values}.")
        if not data.sized:
            words.append(
                "COR alone doesn't determine k and n: add a force curve, a contact time or a force."
            )
        default = [option(t.name) for t in data.targets.values() if not t.stated]
        if default:
            words.append(
                f"σ is taken as {measured.DEFAULT_SIGMA * 100:g} % of {', '.join(default)} (none "
                "was given); standard errors and χ² follow from it."
            )
        for name in best.estimated:
            sigma, unit = best.sigma[data.groups[name]][0], " N" if name == "curve" else ""
            words.append(
                f"σ of {data.series[name].name} follows from its residuals: {sigma:.3g}{unit}; "
                "so χ² is close to the degrees of freedom for any law and doesn't test it."
            )
        chance = best.probability
        if chance is not None and chance < _UNLIKELY:
            words.append(
                f"This law doesn't fit: χ² = {best.chi_squared:.4g} with "
                f"{best.degrees_of_freedom} degrees of freedom (probability {chance:.1g}). The law "
                "is wrong, σ is too small, or measurements contradict each other."
            )
        elif chance is not None:
            words.append(
                f"χ² = {best.chi_squared:.4g} with {best.degrees_of_freedom} degrees of freedom is "
                f"what law and σ lead to (probability of a larger one {chance:.2g})."
            )
        elif best.degrees_of_freedom <= 0 and best.chi_squared > 1e-4:
            words.append(
                "This law can't meet these targets together; the fit comes nearest to them, and "
                "standard errors are those of the σ alone."
            )
        elif best.degrees_of_freedom <= 0:
            words.append(
                f"As many targets as parameters: {best.law.title} meets them exactly, so χ² "
                "doesn't test the law; standard errors are those of the σ alone."
            )
        correlation = self.correlation
        if correlation and correlation[1] > _CORRELATED:
            words.append(
                f"Neighbouring residuals of the curve are correlated ({correlation[0]:.2f}): the "
                "law misses its shape, or its noise is correlated; standard errors are too small."
            )
        return words + self._better()

    @property
    def correlation(self) -> tuple[float, float] | None:
        """Lag-1 autocorrelation of the curve's residuals in contact, and times √rows."""
        if self.data.curve is None:
            return None
        residuals = self.residuals["curve"][contact_rows(self.data.curve.y)]
        square = float(residuals @ residuals)
        if square == 0.0:
            return None
        value = float(residuals[1:] @ residuals[:-1]) / square
        return value, value * math.sqrt(len(residuals))

    def _better(self) -> list[str]:
        fits = [other for _, other in self.compared if isinstance(other, Fit)]
        best = min((self.fit, *fits), key=lambda other: other.aic)
        if self.fit.aic - best.aic <= _BETTER:
            return []
        return [
            f"{best.law.title} describes these measurements better: its AIC is lower by "
            f"{self.fit.aic - best.aic:.3g}. Try {best.law.options}."
        ]

    # Tables

    def tables(self) -> list[Table]:
        """Parameters, measurements, predictions, and the comparison of laws."""
        best, impact = self.fit, self.data.conditions
        parameters = [[PARAMETERS[n], with_error(*one)] for n, one in self.parameters.items()]
        if "exponent" in best.values and "exponent" not in best.free:
            parameters.append([PARAMETERS["exponent"], f"{best.values['exponent']:g} (fixed)"])
        if best.touch[1] is not None:
            touch = with_error(best.touch[0] * 1e6, best.touch[1] * 1e6)
            parameters.append(["touch, by the curve's clock (µs)", touch])
        tables = [
            Table(
                f"{best.law.title} (law {best.law.law})",
                ["", "value ± standard error"],
                parameters,
            )
        ]
        rows = []
        for n, (name, target) in enumerate(self.data.targets.items()):
            value, sigma = _shown(name, target.value), _shown(name, target.sigma, 2)
            model, residual = _shown(name, best.predicted[name]), f"{best.residuals[n]:+.2f}"
            rows.append([_SHOWN[name].label, value, sigma, model, residual])
        for name, one in self.data.series.items():
            at, unit = self.data.groups[name], " (N)" if name == "curve" else ""
            residuals, sigmas = best.residuals[at], best.sigma[at]
            sigma = f"{sigmas.min():.3g}" + f"–{sigmas.max():.3g}" * bool(np.ptp(sigmas) > 0.0)
            rms = f"rms {math.sqrt(float(np.mean(residuals**2))):.2f}"
            label = {"curve": "force curve", "cor_speeds": "COR at speeds"}[name]
            rows.append([label + unit, f"{len(one.y)} rows", sigma, "", rms])
        for name, one_value in best.predicted.items():
            if name not in self.data.targets:
                rows.append([_SHOWN[name].label, "", "", _shown(name, one_value), "predicted"])
        tables.append(
            Table(
                f"Measurements at {impact.club_speed:g} m/s, club {impact.m_club:g} kg, ball "
                f"{impact.m_ball:g} kg: χ² = {best.chi_squared:.4g}, degrees of freedom "
                f"{best.degrees_of_freedom}",
                ["", "measured", "σ", "model", "residual (σ)"],
                rows,
            )
        )
        rows = []
        for n, speed in enumerate(self.speeds):
            cells = [f"{speed:g}"]
            for name in PREDICTED:
                value, _, high = (part[n] for part in self.predictions[name])
                cells.append(with_error(value, high - value if high == high else None))
            rows.append(cells)
        tables.append(
            Table(
                "Predictions with 95 % intervals (parameters' covariance; valid if the law is)",
                ["club speed (m/s)", *(QUANTITIES[name].label for name in PREDICTED)],
                rows,
            )
        )
        return [*tables, self._comparison()] if self.compared else tables

    def _comparison(self) -> Table:
        labels = ["k (N/m)", "b (N·s/m)", "n", "χ²", "degrees of freedom", "AIC − least AIC"]
        if self.fit.estimated:
            labels[3] = "σ " + ", ".join(self.fit.estimated)
        labels += [one.label for one in _SHOWN.values()]
        least = min((one.aic for _, one in self.compared if isinstance(one, Fit)), default=0.0)
        columns = []
        for _, one in self.compared:
            if isinstance(one, str):
                columns.append([one, *[""] * (len(labels) - 1)])
                continue
            k, b, n = (one.values[name] for name in ("k", "b", "exponent"))
            sigmas = [f"{one.sigma[self.data.groups[name]][0]:.3g}" for name in one.estimated]
            chi = ", ".join(sigmas) or f"{one.chi_squared:.3g}"
            freedom, aic = str(one.degrees_of_freedom), f"{one.aic - least:.3g}"
            columns.append(
                [f"{k:.4g}", f"{b:.3g}", f"{n:.4g}", chi, freedom, aic]
                + [_shown(name, one.predicted[name], 4) for name in TARGETS]
            )
        rows = [list(row) for row in zip(labels, *columns, strict=True)]
        return Table("Contact laws compared", ["", *[law.title for law, _ in self.compared]], rows)

    # Files

    def as_json(self) -> dict[str, Any]:
        """All of it, for calibrate.json (SI units); null where something isn't defined."""
        best, data = self.fit, self.data
        return {
            "version": VERSION,
            "command": self.command,
            "law": best.law.law,
            "title": best.law.title,
            **_numbers(best),
            "touch_time": dict(zip(Estimate._fields, best.touch)) if data.curve else None,
            "fixed": {n: v for n, v in best.values.items() if n not in best.free},
            "targets": [
                {
                    "name": name,
                    "target": target.value,
                    "sigma": target.sigma,
                    "sigma_given": target.stated,
                    "model": best.predicted[name],
                    "residual": best.residuals[n],
                }
                for n, (name, target) in enumerate(data.targets.items())
            ],
            "series": {
                name: {
                    "name": one.name,
                    "rows": len(one.y),
                    "sigma": float(np.mean(best.sigma[data.groups[name]])),
                    "sigma_given": name not in best.estimated,
                    "rms_residual": float(np.sqrt(np.mean(best.residuals[data.groups[name]] ** 2))),
                }
                for name, one in data.series.items()
            },
            "residual_correlation": self.correlation[0] if self.correlation else None,
            "predictions": [
                {"club_speed": speed}
                | {
                    name: {part: getattr(self.predictions[name], part)[n] for part in parts}
                    for name in PREDICTED
                }
                for parts in (Interval._fields,)
                for n, speed in enumerate(self.speeds.tolist())
            ],
            "other_solutions": best.others,
            "notes": self.words,
            "comparison": [
                {"title": law.title, "law": law.law, "exponent": law.exponent}
                | (
                    {"not_fitted": one}
                    if isinstance(one, str)
                    else {"exponent": one.values["exponent"], **_numbers(one)}
                )
                for law, one in self.compared
            ],
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
    known = {name: f"sigma_{name}" for name in TARGETS}
    if unknown := set(scalars) - {*known, *known.values()}:
        raise UserError(f"there is no target {min(unknown)!r}: choose from {', '.join(known)}")
    chosen = ContactLaw.of(law, exponent, reference_compression)
    data = measured.measurements(
        {name: (scalars.get(name), scalars.get(sigma)) for name, sigma in known.items()},
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
    if data.cor_speeds is not None and law.law == 1:
        raise UserError(
            "--cor-speeds is refused with --law 1, whose damping has no COR line: take --law 2"
        )
    measured.check_together(data, law.law)
    if why := missing(law, data):
        raise UserError(f"too few targets for {law.title}: {why}")


def check_save(path: Path) -> Path:
    """A path that a ball can be saved to; UserError if it can't."""
    if path.suffix != ".toml":
        raise UserError(f"--save {path} is refused: the name of a ball's file must end in .toml")
    prepare(path.parent, path.name)
    return path


def _shown(name: str, value: float, digits: int = 5) -> str:
    return f"{value * _SHOWN[name].factor:.{digits}g}"


def _numbers(one: Fit) -> dict[str, Any]:
    """The part of calibrate.json that every fit has."""
    return {
        "parameters": {
            name: {"value": one.values[name], "standard_error": error}
            for name, error in one.standard_errors.items()
        },
        "covariance": one.covariance.tolist(),
        "predicted": one.predicted,
        "chi_squared": one.chi_squared,
        "degrees_of_freedom": one.degrees_of_freedom,
        "probability": one.probability,
        "aic": one.aic,
    }
