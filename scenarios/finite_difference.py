"""The document's scheme (peers/document_fmu.py) as a second FMU: it gives its printed numbers."""

import math

from golf_impact.scenario import Report, document, document_fmu, label, main

TITLE = "Finite difference: the document's scheme as an FMU"
CHAPTER = 12


def _printed_cases():
    """Name, inputs and printed numbers of all cases in the document."""
    yield "baseline", {}, document.BASELINE
    yield "elastic", {"b": 0.0}, document.ELASTIC
    yield "elastic, k = 0.5e6", {"b": 0.0, "k": 0.5e6}, document.ELASTIC_SOFT
    yield "50 m/s", {"club_speed": 50.0}, document.CLUB_SPEED[50.0]
    for k, row in document.COMPRESSION.items():
        yield f"k = {k / 1e6:g}e6", {"k": k}, row
    yield "old ball", {"k": 0.5e6, "b": 12.0}, document.OLD_BALL[0.5e6, 12.0]


def run(fmu):
    """All cases of the document by its scheme and exactly; then the scheme with other steps."""
    report = Report(TITLE, fmu)
    errors = {}
    with document_fmu() as euler:
        for name, values, printed in _printed_cases():
            exact = report.impact(name, **values)
            scheme = report.cases[f"{name}, document's scheme"] = euler.as_printed(**values)
            case = name.replace("e6", "e6 N/m")
            report.compare(f"The document's scheme: {case}", printed, scheme, exact)
            for metric, number in printed.items():
                quantity, found = label(metric), scheme[metric]
                errors[f"{quantity}, {case}"] = abs(found / exact[metric] - 1.0)
                # Rounded or truncated: the document does both (K1 = 128.625 is printed 128.62).
                reproduced = number.is_near(found, 1.05)
                known = document.NOT_REPRODUCED.get((name, metric))
                if known and not reproduced and document.Printed(known.scheme).is_near(found):
                    words = f"printed {number.text}, the scheme gives {known.scheme}"
                    report.deviations.append(f"{known.case}: {words}")
                    continue
                claim = f"{name}: the scheme's {quantity} agrees with the printed {number.text}"
                report.check(claim, reproduced, f"{found:.8g}", "documents")
        velocity = report.cases["baseline"]["ball_velocity"]
        coarse, fine = (abs(euler.impact(h)["ball_velocity"] - velocity) for h in (4e-6, 0.25e-6))

    order = math.log2(coarse / fine) / 4.0
    claim = "the order of the scheme is that of explicit Euler, 1"
    report.check(claim, 0.9 < order < 1.1, f"measured: {order:.3f}")
    largest = max(errors, key=errors.__getitem__)
    report.conclude(
        f"The document's scheme reproduces {len(errors) - len(report.deviations)} of {len(errors)} "
        f"printed numbers; its largest error against the exact solution is "
        f"{errors[largest] * 100:.2f} % ({largest})."
    )
    report.say("It takes some 1240 communication steps of 0.5 µs; the exact FMU needs one.")
    return report


if __name__ == "__main__":
    main(__file__)
