"""Records of a ball as a lab measures them: force curves and COR over speed, with noise."""

import numpy as np
from compare import assert_within

import golf_impact
from golf_impact.calibration.model import ContactLaw

#: A ball, and the conditions of its curves.
BALL = {"law": 2, "k": 8.2e5, "b": 37.0, "exponent": 1.6}
AT = {"club_speed": 40.0, "m_club": 0.2}

FREE, LINEAR = ContactLaw(2, None), ContactLaw(2, 1.0)


def record(
    rows=551, noise=40.0, lead=0.15, trail=0.25, seed=1, shift=0.0123, baseline=(0.0, 0.0), **values
):
    """Instants by a shifted clock, s, and force with noise and a sensor's offset and drift, N."""
    values = {**BALL, **AT, **values}
    contact = golf_impact.run_impact(("contact_time",), **values)["contact_time"]
    instants, force = np.linspace(-lead * contact, (1.0 + trail) * contact, rows), np.zeros(rows)
    inside = instants > 0.0
    path = golf_impact.run_trajectory(outputs=("force",), times=instants[inside], **values)
    force[inside] = path["force"]
    force += np.linspace(baseline[0], sum(baseline), rows)
    return instants + shift, force + np.random.default_rng(seed).normal(0.0, noise, rows)


def line(seed=0, rest=0.86, slope=0.0029, sigma=0.004):
    """Approach speeds, m/s, and COR with noise."""
    speeds = np.repeat(np.arange(20.0, 56.0, 5.0), 2)
    noise = np.random.default_rng(seed).normal(0.0, sigma, len(speeds))
    return speeds, rest - slope * speeds + noise


def write(path, *columns, head="time,force"):
    """A CSV file of columns; returns its path."""
    rows = (",".join(f"{cell:.9g}" for cell in row) for row in zip(*columns))
    path.write_text("\n".join([head, *rows, ""]), "utf-8")
    return path


def deviations(found, true=BALL):
    """(found − true) in standard errors."""
    return [(one.value - true[n]) / one.standard_error for n, one in found.parameters.items()]


def assert_found(found, true=BALL):
    """Fail unless all parameters are within four standard errors of the true ones."""
    __tracebackhide__ = True
    for (name, one), off in zip(found.parameters.items(), deviations(found, true)):
        assert_within(abs(off), 4.0, name, found=one.value, exact=true[name])
