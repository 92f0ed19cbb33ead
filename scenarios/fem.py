"""Roh & Lee's finite-element results, the document's rough calculation from them, and its fit."""

from golf_impact.scenario import QUANTITIES, Report, document, main, measured

TITLE = "FEM: finite elements and the document's fit"
CHAPTER = 7


def envelope():
    """The document's rough calculation from Roh & Lee's figures (SI units)."""
    paper, figures = document.ROH_LEE, measured.ROH_LEE_FIGURES
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
        "smash factor": figures["smash_factor"],
        "coefficient of restitution": figures["coefficient_of_restitution"],
        "initial momentum": m_club * u,
        "final momentum": m_club * v_club + m_ball * v_ball,
        "initial kinetic energy": before,
        "final kinetic energy": after,
        "energy lost": 1.0 - after / before,
    }


def run(fmu):
    report = Report(TITLE, fmu)
    numbers, rows = envelope(), []
    units = ("N", "m", "", "", "", "N·s", "N·s", "J", "J", "%")
    for (name, printed), unit in zip(document.ENVELOPE.items(), units, strict=True):
        head = f"{name} ({unit})" if unit else name
        rows.append([head, printed.text, f"{numbers[name] / printed.scale:.5g}"])
        # One unit of the last digit: the document rounds some numbers and truncates others.
        claim = f"{name}, from the paper's figures, agrees with the printed {printed.text}"
        why, allowed = "one unit of the last printed digit", 2.0 * printed.half_digit
        report.check_close(claim, numbers[name], printed.value, allowed, why, "documents")
    report.table("Rough calculation from the paper's figures", ["", "document", "computed"], rows)

    model = report.impact("law 1 (the document's fit)")
    relative = report.impact("law 2, the same k and b", law=2)
    rows, errors = [], {}
    for metric, value in measured.ROH_LEE_FIGURES.items():
        quantity = QUANTITIES[metric]
        rows.append([quantity.plain, f"{value * quantity.factor:.5g}"])
        errors[metric] = [(metrics[metric] / value - 1.0) * 100 for metrics in (model, relative)]
        for metrics, error in zip((model, relative), errors[metric]):
            rows[-1] += [f"{metrics[metric] * quantity.factor:.5g}", f"{error:+.1f}"]
    title = "Roh & Lee's finite-element ball and the document's fit (k = 1e6 N/m, b = 9 N·s/m)"
    report.table(title, ["", "paper", "law 1", "error (%)", "law 2", "error (%)"], rows)
    force, time = errors["max_force"][0], errors["contact_time"][0]
    claim = "the fit agrees with the paper's force and contact time within 5 %"
    words = f"{force:+.1f} % and {time:+.1f} %"
    report.check(claim, max(abs(force), abs(time)) < 5.0, words, "documents")
    error = errors["coefficient_of_restitution"][0]
    claim = "the fit exceeds the paper's COR by more than a quarter"
    report.check(claim, error > 25.0, f"{error:+.1f} %")
    report.say(
        "The document's k and b reproduce maximum force and contact time of the finite-element "
        f"ball (errors {words}), but not its losses: the error in COR is {error:+.1f} %. As law 1 "
        f"also loses momentum, E = {model['energy_efficiency'] * 100:.1f} % is closer to the "
        f"{(1.0 - numbers['energy lost']) * 100:.1f} % from the paper's figures."
    )
    return report


if __name__ == "__main__":
    main(__file__)
