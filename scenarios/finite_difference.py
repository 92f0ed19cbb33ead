"""The document's own scheme as a second FMU: where its printed numbers come from.

Explicit Euler with a step of 0.5 µs, in a deliberately ordinary pythonfmu slave
(golf_impact/peers/document_fmu.py).
"""

import math

from golf_impact.scenario import Report, document, document_fmu, label, main

TITLE = "Finite difference: the document's scheme as an FMU"
CHAPTER = 12

#: Printed numbers that the scheme doesn't give to the last digit, and what it gives.
OUT_OF_LINE = {
    ("baseline", "kinetic_energy_final"): "117.62",
    ("k = 1e6", "ball_velocity"): "54.84, as the document prints elsewhere",
    ("k = 2e6", "ball_velocity"): "55.67",
}


def _printed_cases():
    """Name, inputs and printed numbers of every case that the document prints."""
    yield "baseline", {}, document.BASELINE
    yield "elastic", {"b": 0.0}, document.ELASTIC
    yield "elastic, k = 0.5e6", {"b": 0.0, "k": 0.5e6}, document.ELASTIC_SOFT
    yield "50 m/s", {"club_speed": 50.0}, document.CLUB_SPEED[50.0]
    for k, row in document.COMPRESSION.items():
        yield f"k = {k / 1e6:g}e6", {"k": k}, row
    yield "old ball", {"k": 0.5e6, "b": 12.0}, document.OLD_BALL[0.5e6, 12.0]


def run(fmu):
    """Every case of the document, by its scheme and exactly; then the scheme with smaller steps."""
    report = Report(TITLE, fmu)
    errors = {}
    with document_fmu() as euler:
        for name, values, printed in _printed_cases():
            exact = report.impact(name, **values)
            scheme = report.cases[f"{name}, document's scheme"] = euler.as_printed(**values)
            case = name.replace("e6", "e6 N/m")
            report.compare(f"The document's scheme: {case}", printed, scheme, exact)
            for metric, number in printed.items():
                errors[f"{label(metric)}, {case}"] = abs(scheme[metric] / exact[metric] - 1.0)
                # Rounded or cut: the document does either (K1 = 128.625 is printed 128.62).
                reproduced = abs(scheme[metric] - number.value) <= number.half_digit * 1.05
                claim = f"{name}: the scheme prints {label(metric)} {number.text}"
                words = f"{scheme[metric]:.8g}"
                if odd := OUT_OF_LINE.get((name, metric)):
                    claim = f"{name}: {label(metric)} {number.text} is out of line"
                    words = f"it gives {odd}"
                report.check(claim, reproduced != bool(odd), words)
        right = report.cases["baseline"]["ball_velocity"]
        steps = (4e-6, 2e-6, 1e-6, 0.5e-6, 0.25e-6)
        off = {dt: abs(euler.impact(dt)["ball_velocity"] - right) for dt in steps}

    order = math.log(off[steps[0]] / off[steps[-1]]) / math.log(steps[0] / steps[-1])
    report.check("explicit Euler is of first order", 0.9 < order < 1.1, f"{order:.3f} measured")
    largest = max(errors, key=errors.__getitem__)
    report.say(
        f"The scheme reproduces every printed number but {len(OUT_OF_LINE)}; its largest error is "
        f"{errors[largest] * 100:.2f} % ({largest}).",
        f"Its error in the ball's velocity falls with the {order:.2f}th power of the step: "
        f"{off[document.TIME_STEP]:.4f} m/s at 0.5 µs, over some 1240 communication steps. The "
        "exact FMU takes one.",
    )
    return report


if __name__ == "__main__":
    main(__file__)
