"""Roh & Lee's finite-element ball beside the model, with the back of the document's envelope."""

from golf_impact.scenario import QUANTITIES, Report, document, main, measured

TITLE = "Finite elements: Roh & Lee's figures and the model"
CHAPTER = 7


def envelope():
    """The document's back-of-the-envelope numbers, worked out from Roh & Lee's figures (SI)."""
    paper = document.ROH_LEE
    m_club, m_ball = paper["m_club"], paper["m_ball"]
    u, v_club, v_ball = paper["club_speed"], paper["club_velocity"], paper["ball_velocity"]
    force = m_ball * v_ball / paper["contact_time"]
    distance = 0.5 * m_ball * v_ball**2 / force
    before = 0.5 * m_club * u**2
    after = 0.5 * (m_club * v_club**2 + m_ball * v_ball**2)
    return {
        "average force": force,
        "contact distance": distance,
        "contact distance / R": distance / paper["radius"],
        "smash factor": v_ball / u,
        "coefficient of restitution": (v_ball - v_club) / u,
        "initial momentum": m_club * u,
        "final momentum": m_club * v_club + m_ball * v_ball,
        "initial kinetic energy": before,
        "final kinetic energy": after,
        "energy lost": 1.0 - after / before,
    }


def run(fmu):
    """The envelope, and the document's fit under both laws."""
    report = Report(TITLE, fmu)
    numbers, rows = envelope(), []
    units = ("N", "m", "", "", "", "N·s", "N·s", "J", "J", "%")
    for (name, printed), unit in zip(document.ENVELOPE.items(), units, strict=True):
        value = numbers[name]
        rows.append([f"{name} ({unit})" if unit else name, printed.text, printed.shown(value)])
        # One unit of the last digit: the document rounds some numbers and cuts others.
        claim, allowed = f"{name} is the printed {printed.text}", 2.0 * printed.half_digit
        why = "one unit of the last printed digit"
        report.check_close(claim, value, printed.value, allowed, why)
    title = "Back of the envelope, from the paper's figures"
    report.table(title, ["", "document", "computed"], rows)

    model = report.impact("law 1 (the document's fit)")
    relative = report.impact("law 2, the same k and b", law=2)
    rows, misses = [], {}
    for metric, value in measured.ROH_LEE_FIGURES.items():
        quantity = QUANTITIES[metric]
        cells = [quantity.plain, f"{value * quantity.factor:.5g}"]
        for metrics in (model, relative):
            off = metrics[metric] / value - 1.0
            cells += [f"{metrics[metric] * quantity.factor:.5g}", f"{off * 100:+.1f}"]
        rows.append(cells)
        misses[metric] = model[metric] / value - 1.0
    title = "Roh & Lee's finite-element ball and the document's fit (k = 1e6 N/m, b = 9 N·s/m)"
    report.table(title, ["", "paper", "law 1", "off (%)", "law 2", "off (%)"], rows)
    force, time = misses["max_force"], misses["contact_time"]
    restitution = misses["coefficient_of_restitution"]
    report.check(
        "the fit meets force and contact time within 5 %",
        abs(force) < 0.05 and abs(time) < 0.05,
        f"{force * 100:+.1f} % and {time * 100:+.1f} %",
    )
    claim = "the fit misses COR by more than a quarter"
    report.check(claim, restitution > 0.25, f"{restitution * 100:+.1f} %")
    report.say(
        "Verdict: k = 1e6 N/m and b = 9 N·s/m reproduce how hard and how long the finite-element "
        f"ball pushes (force {force * 100:+.1f} %, time {time * 100:+.1f} %), "
        "but not what it gives back: the model returns "
        f"{model['energy_efficiency'] * 100:.1f} % of the kinetic energy, the paper's figures "
        f"{(1.0 - numbers['energy lost']) * 100:.1f} %, and COR is "
        f"{model['coefficient_of_restitution']:.3f} against "
        f"{numbers['coefficient of restitution']:.3f}. As law 1 loses momentum besides, its energy "
        "figure looks better than its COR."
    )
    return report


if __name__ == "__main__":
    main(__file__)
