"""A calibration: law 2 fitted to measurements, and what follows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import lmfit
import numpy as np
from scipy.special import chdtrc, stdtrit

from golf_impact.api import run_impacts
from golf_impact.data.balls import Ball, ball_toml
from golf_impact.data.errors import UserError, refused
from golf_impact.data.files import write
from golf_impact.data.quantities import format_options
from golf_impact.studies.calibrate import report
from golf_impact.studies.calibrate.fit import REFERENCE_COMPRESSION, Estimate, Problem, at_limits
from golf_impact.studies.calibrate.measurements import (
    IMPACT,
    RESTITUTION,
    TARGETS,
    UNITS,
    compute_scalars,
    inputs,
    measurements,
    number,
)
from golf_impact.studies.intervals import RANGES, standard_errors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: What is predicted.
_PREDICTED = ("smash_factor", "coefficient_of_restitution", "ball_velocity")


class Interval(NamedTuple):
    """Predictions with their 95 % intervals, arrays of one shape."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Calibration:
    """The parameters of law 2 that meet measurements best.

    They are found by weighted least squares from several starts. A σ that isn't given is estimated
    from the residuals, for each series separately. A parameter that ends at its limit is held there
    while the others are fitted.

    Attributes:
        data: the measurements.
        result: lmfit's `MinimizerResult`; touch is in µs since a curve's origin, drift in N/ms.
        values: the FMU's inputs and parameters of this impact, SI units.
        parameters: value, standard error and 95 % interval of the fitted ones, by their FMU names.
        covariance, correlations: theirs; 0 for one at its limit.
        curves: of each curve `touch_time`, by its clock (s), and, as far as its sensor has them,
            `offset` (N) and `drift` (N/s).
        predicted: scalar targets as the physics gives them.
        predictions: what `predict` gives at 30, 40 and 50 m/s; empty if physics refuses one.
        residuals, sigma: (model − measured)/σ of the measured values, and their σ, by part.
        rms: residuals of each series, root mean square in its unit.
        row_correlations: lag-1 autocorrelations of residuals in contact, where they aren't chance.
        curves_differ: whether curves differ by more than noise in k (95 %).
        chi_squared, degrees_of_freedom: of the residuals.
        probability: of a larger χ² if law and σ are right; None if χ² has no meaning.
        aic: Akaike's criterion, −2 ln(likelihood) + 2 p, but for a constant.
        coverage: half the width of a 95 % interval in standard errors: Student's t or normal.
        linear: the fit of n = 1 beside another exponent, if there is one.

    Raises:
        UserError: the measurements don't determine the law's parameters, or no contact that ends
            comes near them.
    """

    linear: Calibration | None = None

    def __init__(self, problem: Problem) -> None:
        self.data, self.title = problem.data, problem.title
        self.exponent = problem.fixed.get("exponent")
        estimated = self.data.estimated
        with np.errstate(all="ignore"):
            result = problem.minimum()
            # The minimum doesn't depend on an only σ.
            for _ in range(3 if len(problem.parts) > 1 else 1):
                problem.estimate_sigma(result)
                result = problem.solve(result.params)
            self.sigma = {**problem.sigma}
            self.row_correlations = problem.enlarge_sigma(result)
            result = problem.solve(result.params, near=0.75)
            if ends := at_limits(result):
                for name, one in ends.items():
                    result.params[name].set(value=one.value, vary=False)
                result = problem.solve(result.params, near=0.75)
            freedom = result.nfree - len(ends)
            self.coverage = float(stdtrit(max(1, freedom) if estimated else 1e9, 0.975))
            profiles = problem.profiles(result, self.coverage)
        self.result, self.curves_differ = result, problem.curves_differ(result)

        def estimate(name: str, unit: float = 1.0, zero: float = 0.0) -> Estimate:
            value, error = result.params[name].value, unit * result.params[name].stderr
            value, half = zero + unit * value, self.coverage * error
            return Estimate(value, error, profiles.get(name, (value - half, value + half)))

        names = [name for name in problem.names if name in (*result.var_names, *ends)]
        self.parameters = {name: ends.get(name) or estimate(name) for name in names}
        self.curves = {
            curve: {
                ("touch_time" if of == "touch" else of): estimate(
                    of + one.suffix, unit, one.origin if of == "touch" else 0.0
                )
                for of, unit in UNITS.items()
                if of + one.suffix in result.params
            }
            for curve, one in self.data.curves.items()
        }
        places = [result.var_names.index(name) if name not in ends else -1 for name in names]
        self.covariance = np.pad(result.covar, (0, 1))[np.ix_(places, places)]
        errors = [one.standard_error or math.inf for one in self.parameters.values()]
        self.correlations = self.covariance / np.outer(errors, errors)

        problem.sigma = self.sigma  # of the noise, not enlarged
        rows = problem.residual(result.params)
        self.residuals = problem.split(rows)
        self.chi_squared, self.degrees_of_freedom = float(rows @ rows), freedom
        tested = freedom > 0 and not estimated
        self.probability = float(chdtrc(freedom, self.chi_squared)) if tested else None
        logarithms = sum(float(np.log(one).sum()) for one in self.sigma.values())
        self.aic = self.chi_squared + 2.0 * logarithms + 2.0 * (len(rows) - freedom)
        self.rms = {
            name: math.sqrt(np.mean((self.residuals[name] * self.sigma[name]) ** 2))
            for name in self.data.series
        }
        reference = {"reference_compression": REFERENCE_COMPRESSION} if problem.sized else {}
        values = inputs(result.params.valuesdict(), self.data.impact)
        self.values = {"law": 2, **reference, **values}
        targets = [name for name in TARGETS if problem.sized or name in RESTITUTION]
        self.predicted = compute_scalars(targets, self.values)
        self.predictions: dict[str, Interval] = {}
        with suppress(UserError):  # a steep line of COR may end below these speeds
            self.predictions = self.predict(report.SPEEDS)

    def _covariance(self, names: Sequence[str]) -> np.ndarray:
        """Of these parameters."""
        places = [[*self.parameters].index(name) for name in names]
        return self.covariance[np.ix_(places, places)]

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
        names = [name for name in self.parameters if name != "club_speed"]
        errors = standard_errors(_PREDICTED, values, names, self._covariance(names))
        moved = [
            run_impacts(_PREDICTED, **{**values, name: end})
            for name, one in self.parameters.items()
            if one.limit is not None
            for end in one.interval
        ]
        predicted = {}
        for output, value in found.items():
            low = high = self.coverage * errors[output]
            for change in (np.nan_to_num(one[output] - value) for one in moved):
                low = np.hypot(low, np.minimum(change, 0.0))
                high = np.hypot(high, np.maximum(change, 0.0))
            predicted[output] = Interval(value, value - low, value + high)
        return predicted

    @property
    def ball(self) -> Ball:
        """The ball that was found; `**ball.values` are inputs and parameters of the FMU."""
        data, values = self.data, self.values
        measured = [*data.scalars.targets]
        measured += [f"{len(one.y)} rows of {one.name}" for one in data.series.values()]
        speeds = [one.impact["club_speed"] for one in data.curves.values()]
        speeds += [*data.cor_speeds.x] if data.cor_speeds else []
        # The impact isn't part of the ball, but for a mass of its own.
        of_impact = {*IMPACT} - ({"m_ball"} if values["m_ball"] != IMPACT["m_ball"] else set())
        uncertain = [n for n, one in self.parameters.items() if n in RANGES and one.limit is None]
        limits = report.describe_limits(self.parameters)
        return Ball(
            name="calibrated",
            title=f"calibrated, {self.title}",
            values={name: value for name, value in values.items() if name not in of_impact},
            source=f"golf-impact calibrate: {', '.join(measured)}; {report.describe_impact(data)}",
            uncertain=tuple(uncertain),
            covariance=tuple(map(tuple, self._covariance(uncertain).tolist())),
            conditions={n: values[n] for n in IMPACT if n != "m_ball" and n in data.given},
            speeds=(float(min(speeds)), float(max(speeds))) if speeds else (),
            # Nobody has measured a stiffness that nothing depends on.
            undetermined=() if "k" in values else ("k",),
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
        title = f"Calibration: {self.title} (law 2)"
        return "\n".join([title, *found, f"  {report.describe_chi_squared(self)}"])

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
        name, why = other[0], f"choose from n, {', '.join(RANGES)}"
        raise refused(name, fixed[name], why, f"fix {name}")
    if "exponent" not in {**fixed, **priors} and exponent != "free":
        fixed["exponent"] = exponent
    fixed = {name: number(value, name, "fix" if fix else "") for name, value in fixed.items()}
    data = measurements(scalars, curve, cor_speeds, columns, baseline, priors, window, shots)
    found = Calibration(Problem(data, fixed))
    if found.exponent != 1.0 and data.sized:
        with suppress(UserError):  # with too few measurements
            found.linear = Calibration(Problem(data, {**fixed, "exponent": 1.0}))
    return found
