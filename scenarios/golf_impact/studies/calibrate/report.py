"""A calibration as sentences, tables of text, and data for calibrate.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from golf_build import VERSION
from golf_impact.data.quantities import (
    QUANTITIES,
    Quantity,
    format_to_error,
    format_unit,
    format_with_error,
)
from golf_impact.data.units import unit_of
from golf_impact.studies.calibrate.fit import Estimate, enlargement
from golf_impact.studies.calibrate.measurements import (
    BASELINES,
    DEFAULT_SIGMA,
    IMPACT,
    TARGETS,
    Measurements,
)

#: Club speeds of the predictions, m/s.
SPEEDS = np.array([30.0, 40.0, 50.0])

#: What is worth a sentence: a χ² that law and σ exceed less often, an AIC lower by this.
_UNLIKELY, _BETTER = 0.01, 2.0

#: Title, columns, rows of text.
Table = tuple[str, list[str], list[list[str]]]


def describe_impact(data: Measurements) -> str:
    """The impact in which scalars or a curve were measured."""
    if len(data.curves) > 1:
        return f"{len(data.curves)} curves"
    if not data.curves and not data.scalars.measured:
        return "COR over speed"
    return "{club_speed:g} m/s, club {m_club:g} kg, ball {m_ball:g} kg".format(**data.impact)


def describe_chi_squared(fit: Any) -> str:
    """Less than 1e-4 is rounding."""
    return f"χ² = {round(fit.chi_squared, 4):.4g}, degrees of freedom {fit.degrees_of_freedom}"


def describe_limits(parameters: Mapping[str, Estimate]) -> dict[str, str]:
    """Of each parameter at its limit, how far from it the truth may be."""
    words = {}
    for name, (_, _, (low, high), limit) in parameters.items():
        if limit is not None:
            end = f"at most {high:.3g}" if limit == low else f"at least {low:.3g}"
            words[name] = f"{end} {_quantity(name).unit}".rstrip()
    return words


def sentences(fit: Any) -> list[str]:
    """What the numbers of a calibration say."""
    data, words = fit.data, []
    for name, end in describe_limits(fit.parameters).items():
        limit = f"{name} is at its limit {fit.parameters[name].limit:g}"
        words.append(f"{limit}: check club speed and mass. Its 95 % interval is one-sided, {end}.")
    if default := [name for name, one in data.scalars.measured.items() if not one.stated]:
        words.append(f"σ is taken as {DEFAULT_SIGMA * 100:g} % of {', '.join(default)}.")
    for name, series in data.series.items():
        words += [f"{series.name}: {note}." for note in series.notes]
        if name in data.curves:
            words.append(f"{series.name}: baseline {BASELINES[len(series.baseline)]}.")
        if series.step > 0.01 * series.signal.max():
            words.append(f"{series.name} is resolved in steps of {series.step:.3g} N.")
        if name in data.estimated:
            sigma = f"{fit.sigma[name][0]:.3g}, follows from its residuals"
            words.append(f"σ of {series.name}, {sigma}; so χ² doesn't test the law.")
    if "k" not in fit.values:
        words.append(
            "k is undetermined: COR doesn't depend on it, so force, contact time and compression "
            "don't follow; measure --curve or --measured contact_time=…."
        )
    square = describe_chi_squared(fit)
    if fit.degrees_of_freedom <= 0:
        words.append(f"{square}: no more targets than parameters, so χ² doesn't test the law.")
    elif fit.probability is not None and fit.probability < _UNLIKELY:
        why = "the law is wrong, σ is too small, or measurements contradict each other"
        words.append(f"This law doesn't fit: {square} (probability {fit.probability:.1g}); {why}.")
    elif fit.probability is not None:
        chance = f"(probability of a larger one: {fit.probability:.2g})"
        words.append(f"{square} is compatible with law and σ {chance}.")
    advice = "" if fit.exponent is None else " Try --exponent free."
    for name, r in fit.row_correlations.items():
        errors = f"enlarged by {enlargement(r):.2g}" if name in data.estimated else "too small"
        words.append(
            f"Residuals of the {name} are correlated ({r:.2f}): the law misses its shape, or the "
            f"noise is correlated; standard errors are {errors}.{advice}"
        )
    if fit.curves_differ:
        words.append(
            "The curves differ by more than noise in k (probability below 5 %; club speeds and "
            "masses count as exact)."
        )
    if other := fit.linear:
        values = [f"{name} = {found.value:.4g}" for name, found in other.parameters.items()]
        if sizes := [f"{other.rms[name]:.4g}" for name in data.curves]:
            values.append(f"rms residual {', '.join(sizes)} N")
        lower = fit.aic - other.aic
        if abs(lower) > 0.01:  # nothing is ranked by rounding
            values.append(f"AIC {'lower' if lower > 0.0 else 'higher'} by {abs(lower):.4g}")
        better = ": it describes these measurements better" * (lower > _BETTER)
        words.append(f"With n = 1 instead: {', '.join(values)}{better}.")
    names = [*fit.parameters]
    pairs = [
        f"C({names[m]}, {names[n]}) = {fit.correlations[m, n]:.2f}"
        for m, n in combinations(range(len(names)), 2)
        if fit.correlations[m, n]
    ]
    return [*words, f"Correlations: {', '.join(pairs)}."] if pairs else words


def tables(fit: Any) -> list[Table]:
    """Parameters, measurements and predictions; none is empty."""
    found = ["", "value ± standard error", "95 % interval"]
    measured = ["", "measured", "σ", "model", "residual (σ)"]
    predicted = ["club speed (m/s)", *(QUANTITIES[name].label for name in fit.predictions)]
    predictions, beyond = _predicted(fit)
    at = f"{describe_impact(fit.data)}: {describe_chi_squared(fit)}"
    every = [
        (f"{fit.title} (law 2)", found, _found(fit)),
        (f"Measurements, {at}", measured, _measured(fit)),
        (f"Predictions with 95 % intervals, if the law holds{beyond}", predicted, predictions),
    ]
    return [table for table in every if table[2]]


def _found(fit: Any) -> list[list[str]]:
    found, rows = dict(fit.parameters), []
    for curve, own in fit.curves.items():
        found |= {of + curve.removeprefix("curve"): one for of, one in own.items()}
    for name, (value, error, ends, _) in found.items():
        one, text = _quantity(name), f"{value:.6g} (at its limit)"
        if error is not None:
            error *= one.factor
            text = format_with_error(value * one.factor, error)
        interval = " to ".join(format_to_error(end * one.factor, error) for end in ends)
        rows.append([name, f"{text} {one.unit}".rstrip(), interval])
    return rows


def _measured(fit: Any) -> list[list[str]]:
    rows = []
    for target in _targets(fit):
        name, off = target["name"], target["residual"]
        label = name if name in TARGETS else f"{name} (prior)"
        one = QUANTITIES.get(TARGETS.get(name, ""), Quantity(label))
        value, sigma, model = (target[of] * one.factor for of in ("target", "sigma", "model"))
        texts = format_to_error(value, sigma), f"{sigma:.2g}", format_to_error(model, sigma)
        rows.append([one.label, *texts, f"{off:+.2f}" if abs(off) >= 0.005 else "0.00"])
    for name, series in fit.data.series.items():
        text = f"rms {np.sqrt(np.mean(fit.residuals[name] ** 2)):.2f}"
        if name in fit.data.curves:
            text += f" ({fit.rms[name]:.3g} N), {series.impact['club_speed']:g} m/s"
        sigma = f"{fit.sigma[name].mean():.3g}"
        rows.append([series.name, f"{len(series.y)} rows", sigma, "", text])
    return rows


def _predicted(fit: Any) -> tuple[list[list[str]], str]:
    """At three club speeds, with * where they weren't measured, and what is uncertain there."""
    if line := fit.data.cor_speeds:
        low, high = line.x.min(), line.x.max()
        why = f"COR was measured from {low:.3g} to {high:.3g} m/s"
        others = [speed for speed in SPEEDS if not low <= speed <= high]
    else:
        curves = [one.impact["club_speed"] for one in fit.data.curves.values()]
        measured = curves or [fit.data.impact["club_speed"]]
        why = "if COR didn't depend on speed; measured balls lose 0.0029 per m/s"
        others = [v for v in SPEEDS if min(abs(v - one) for one in measured) > 0.5]
    rows = []
    for speed, *found in zip(SPEEDS, *(zip(*one) for one in fit.predictions.values())):
        texts = []
        for value, low, high in found:
            text = format_with_error(value, high - value)
            if not math.isclose(high - value, value - low, rel_tol=1e-6):
                text = f"{value:.4g} ({low:.4g} to {high:.4g})"
            texts.append(text)
        rows.append([f"{speed:g}{' *' * (speed in others)}", *texts])
    return rows if fit.predictions else [], f" (*: {why})" * bool(others)


def as_json(fit: Any) -> dict[str, Any]:
    """All of it, for calibrate.json (SI units); null where something isn't defined."""
    data, alike = fit.data, ("predicted", "chi_squared", "degrees_of_freedom", "probability", "aic")
    series: dict[str, dict[str, Any]] = {}
    for name, one in data.series.items():
        sigma = {"sigma": float(fit.sigma[name].mean()), "sigma_given": one.sigma is not None}
        series[name] = {"name": one.name, "rows": len(one.y), **sigma, "rms": fit.rms[name]}
        if name in data.curves:
            own = {of: found._asdict() for of, found in fit.curves[name].items()}
            kind = BASELINES[len(one.baseline)]
            series[name] |= {"conditions": dict(one.impact), "baseline": kind, **own}
    predictions: list[dict[str, Any]] = [{"club_speed": v} for v in SPEEDS.tolist()]
    for name, interval in fit.predictions.items():
        for row, *ends in zip(predictions, *(part.tolist() for part in interval)):
            row[name] = dict(zip(interval._fields, ends))
    return {
        "version": VERSION,
        "command": fit.command,
        "title": fit.title,
        "exponent": fit.values.get("exponent"),
        "conditions": {name: fit.values[name] for name in IMPACT},
        "parameters": {name: one._asdict() for name, one in fit.parameters.items()},
        "covariance": fit.covariance.tolist(),
        "correlations": fit.correlations.tolist(),
        **{name: getattr(fit, name) for name in alike},
        "targets": _targets(fit),
        "series": series,
        "predictions": predictions,
        "notes": sentences(fit),
    }


def _targets(fit: Any) -> list[dict[str, Any]]:
    """Each scalar and prior, measured and by the model."""
    measured = zip(fit.data.scalars.measured.items(), fit.residuals.get("targets", []))
    return [
        {"name": name, "target": one.value, "sigma": one.sigma, "sigma_given": one.stated}
        | {"model": one.value + one.sigma * float(off), "residual": float(off)}
        for (name, one), off in measured
    ]


def _quantity(name: str) -> Quantity:
    """How a parameter is printed, also one of a curve, such as offset_2."""
    of_curve = {"touch": ("µs", 1e6), "offset": ("N", 1.0), "drift": ("N/s", 1.0)}
    known = of_curve.get(name.partition("_")[0])
    return Quantity(name, "", *(known or (format_unit(unit_of(name)), 1.0)))
