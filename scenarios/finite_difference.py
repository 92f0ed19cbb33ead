"""The document's scheme, explicit Euler: the printed numbers that it gives, and its error."""

from golf_impact.data import document
from golf_impact.data.quantities import QUANTITIES, derived, describe, format_percent
from golf_impact.scenario import Result, main


def scheme(k=1e6, b=9.0, club_speed=35.0, dt=0.5e-6, end_gap=36e-6, m_club=0.210, m_ball=0.04593):
    """Explicit Euler, as in golfSpring.py: results by the FMU's outputs (SI units).

    The document gives neither its time step nor the end of its simulation. Its printed numbers
    follow with 0.5 µs, if the spring pulls until the bodies are 35 to 48 µm apart.
    """
    x_club = x_ball = v_ball = force = time = impulse = max_force = 0.0
    v_club = club_speed
    while force >= -k * end_gap:
        impulse, time = impulse + dt * force, time + dt
        x_club, x_ball = x_club + dt * v_club, x_ball + dt * v_ball
        v_club -= dt * (force + b * v_club) / m_club
        v_ball += dt * (force - b * v_ball) / m_ball
        force = k * (x_club - x_ball)
        max_force = max(max_force, force)
    energy = 0.5 * (m_club * v_club**2 + m_ball * v_ball**2)
    return {
        "club_velocity": v_club, "ball_velocity": v_ball, "max_force": max_force,
        "contact_time": time, "impulse": impulse, "contact_displacement": x_ball,
        "smash_factor": v_ball / club_speed, "kinetic_energy": energy,
        "coefficient_of_restitution": (v_ball - v_club) / club_speed,
        "energy_efficiency": energy / (0.5 * m_club * club_speed**2),
        "momentum": m_club * v_club + m_ball * v_ball,
    }  # fmt: skip


def run(impact):
    result, errors, missed = Result("The document's scheme: what it prints, and its error"), {}, []
    for name, (values, printed) in document.CASES.items():
        case = {"old": "old ball"}.get(name, name)
        if case in ("35 m/s", "new"):  # the baseline again
            continue
        result.cases[case], by_scheme = impact(**values), scheme(**values)
        result.cases[f"{case}, document's scheme"] = by_scheme
        exact, found = (derived(one, values) for one in (result.cases[case], by_scheme))
        rows = []
        for quantity, number in printed.items():
            about, value = QUANTITIES[quantity], found[quantity]
            error = errors[case, quantity] = value / exact[quantity] - 1.0
            numbers = (about.format_value(one) for one in (value, exact[quantity]))
            rows.append([about.label, number.text, *numbers, format_percent(error)])
            # The document rounds some numbers and truncates others: K1 = 128.625 is 128.62.
            if not number.is_near(value, 1.05):
                missed.append((name, quantity))
        columns = ["", "document", "its scheme", "exact", "error (%)"]
        result.tables.append((f"{case}: {describe(values)}", columns, rows))

    with_table_1 = impact(**document.TABLE_1)
    rows = [[f"{name} ({unit})", *values] for name, unit, *values in document.PARAMETERS]
    for quantity in ("smash_factor", "coefficient_of_restitution", "max_force", "contact_time"):
        about, both = QUANTITIES[quantity], (with_table_1, result.cases["baseline"])
        rows.append([about.label, *(about.format_value(one[quantity]) for one in both)])
    title = f"Table 1 and the values that its numbers come from: {describe({})}"
    result.tables.append((title, ["", "Table 1", "used"], rows))

    worst = max(errors, key=lambda key: abs(errors[key]))
    cor = result.cases["baseline"]["coefficient_of_restitution"]
    coarse, fine = (scheme(dt=dt)["coefficient_of_restitution"] - cor for dt in (5e-7, 2.5e-7))
    result.claims = {
        "the scheme gives all printed numbers but three": missed == [*document.NOT_REPRODUCED],
        "half its time step has some half of its error: order 1": 1.5 < coarse / fine < 2.5,
        "Table 1's values don't give them": not document.agrees("baseline", with_table_1),
    }
    others = (f"{d.case} ({d.printed}; {d.scheme})" for d in document.NOT_REPRODUCED.values())
    result.words = (
        f"The scheme gives {len(errors) - len(missed)} of {len(errors)} printed numbers; not "
        f"{', '.join(others)}. Its largest error is {abs(errors[worst]) * 100:.2f} %, in "
        f"{QUANTITIES[worst[1]].name} of {worst[0]}."
    )
    return result


if __name__ == "__main__":
    main(run)
