"""Loft: tangential force, backspin and launch angle by Launch.fmu, beside measured launches."""

from math import atan, copysign, cos, degrees, exp, pi, radians, sqrt, tan

import numpy as np

from golf_impact.scenario import BALLS, Report, bisect, closed_forms, loaded_shots, main, measured

TITLE = "Loft: tangential force, backspin and launch angle"
CHAPTER = 15

#: Start values of the FMUs: masses (kg), radius (m), friction and stiffness ratio.
_M_CLUB, _M_BALL, _RADIUS = 0.210, 0.04593, 0.5 * 0.04267
_FRICTION, _RATIO = 0.4, 2.0 / 3.0
_EXPONENT = BALLS["penner"].values["exponent"]

#: rpm per rad/s.
_RPM = 30.0 / pi


def run(fmu):
    """Forces of Roh & Lee's club; launches over loft and friction; what backspin rests on."""
    report = Report(TITLE, fmu)
    with loaded_shots(fmu) as shots:
        _show_forces(report, shots)
        _show_range(report, shots)
        _show_assumptions(report, shots)
    return report


def march(restitution, sliding, m_club, damped=True, arms=None, steps=20_000):
    """Tangential force of a contact by explicit Euler steps: another method than Launch.fmu's.

    `sliding` is the speed of the face across the ball at touch over the approach speed; the head
    (kg) doesn't turn; `damped` adds a tangential damper to the spring; `arms` has the lever arm
    of each step divided by the ball's radius (default 1): of the torque on the ball, and of the
    speed of its surface.

    Returns arrays: relative normal velocity divided by the approach speed, normal force and
    tangential force on one scale, and whether the contact slips.
    """
    half = closed_forms.half_contact
    zeta = bisect(lambda z: restitution - exp(-2.0 * z * half(z)), 0.0, 0.9)
    s, size = np.linspace(0.0, 2.0 * half(zeta), steps + 1, retstep=True)
    q, damping = sqrt(1.0 - zeta * zeta), 2.0 * zeta if damped else 0.0
    x, c = np.exp(-zeta * s) * np.sin(q * s) / q, np.exp(-zeta * s) * np.cos(q * s)
    u = c - zeta * x
    normal = np.maximum(x + 2.0 * zeta * u, 0.0)
    ratio = _M_BALL / m_club
    y, p, impulse, torque, tangential, slips = 0.0, sliding, 0.0, 0.0, [], []
    arms = [1.0] * (steps + 1) if arms is None else arms.tolist()
    for limit, arm in zip((_FRICTION * normal).tolist(), arms, strict=True):
        force, rate = _RATIO * (y + damping * p), p
        slips.append(abs(force) > limit)
        if slips[-1]:
            force = copysign(limit, force)
            # Without a damper the spring follows within the step.
            rate = (force / _RATIO - y) / (damping or size)
        tangential.append(force)
        y += rate * size
        impulse += force * size
        torque += arm * force * size
        p = sliding - impulse - 2.5 * arm * torque / (1.0 + ratio)
    return u, normal, np.array(tangential), np.array(slips)


def _show_forces(report, shots):
    """Normal and tangential force over time: Roh & Lee's club."""
    speed, loft = 35.0, radians(11.5)
    shot = shots.shot(speed, loft, ball="roh-lee")
    u, scale, tangential, slips = march(shot["coefficient_of_restitution"], tan(loft), _M_CLUB)
    time, normal, _ = shots.contact("roh-lee", _M_CLUB, speed * cos(loft), u)
    force = normal * np.divide(tangential, scale, out=np.zeros_like(scale), where=scale > 1e-9)
    report.trajectories["loft_forces"] = {"time": time, "normal_force": normal, "force": force}
    most, least = int(np.argmax(force)), int(np.argmin(force))
    turn = float(time[most + int(np.argmax(force[most:] < 0.0))])
    report.cases["Roh & Lee's club"] = shot | {
        "max_tangential_force": float(force[most]),
        "min_tangential_force": float(force[least]),
        "time_of_sign_change": turn,
    }
    claim = "the impulse of the force drawn, by steps, is that of Launch.fmu"
    impulse, ours = float(np.trapezoid(force, time)), shot["tangential_impulse"]
    report.check_close(claim, impulse, ours, 2e-3 * ours, "Euler steps and interpolation")
    claim = "the tangential force creates backspin and reduces it again, as the document says"
    words = f"sign change at {turn * 1e6:.0f} of {time[-1] * 1e6:.0f} µs"
    report.check(claim, 0.0 < turn < time[-1] and force[least] < 0.0, words)
    report.say(
        f"Roh & Lee's club, 11.5° and 35 m/s: the tangential force reaches {force[most]:.0f} N at "
        f"{time[most] * 1e6:.0f} µs and ends after {force[least]:.0f} N; the ball leaves with "
        f"{shot['backspin'] * _RPM:.0f} rpm. Of the second curve of its Fig. 2 the document's text "
        "has the change of sign alone: nothing else is compared.",
    )

    @report.figure("loft_forces", "The ball sticks to the face until friction limits the force.")
    def forces(figures):
        figure, axes = figures.new("Forces on the ball: loft 11.5°, 35 m/s")
        micro, limit = time * 1e6, _FRICTION * normal / 1e3
        axes.plot(micro, normal / 1e3, color=figures.BLUE, label="normal")
        axes.plot(micro, force / 1e3, color=figures.VERMILION, label="tangential, down the face")
        grey = {"color": "0.5", "alpha": 0.15, "lw": 0}
        axes.fill_between(micro, limit, -limit, **grey, label="limit of friction")
        start = float(micro[int(np.argmax(slips))])
        axes.axvspan(start, micro[-1], color=figures.ORANGE, alpha=0.3, lw=0, label="slip")
        axes.annotate("stick", (0.5 * start, -1.9), ha="center")
        axes.axhline(0.0, color=figures.BLACK, lw=0.8)
        axes.set(xlabel="time since touch (µs)", ylabel="force (kN)")
        figures.add_legend_above(axes)
        return figure


def _show_range(report, shots):
    """Backspin and launch angle over loft and over friction, at 40 m/s."""
    lofts, frictions = np.linspace(0.0, 60.0, 61), np.linspace(0.0, 0.6, 61)

    def launches(lofts, frictions):
        pairs = np.broadcast(lofts, frictions)
        return [shots.shot(40.0, radians(loft), friction=mu) for loft, mu in pairs]

    by_loft = {friction: launches(lofts, friction) for friction in (0.1, 0.2, 0.4)}
    by_friction = {loft: launches(loft, frictions) for loft in (10.0, 25.0, 45.0)}
    none = [row[0]["backspin"] for row in by_friction.values()]
    report.check("without friction there is no backspin", none == [0.0] * 3, "exactly 0")
    flat = by_loft[0.4][0]
    same = flat["backspin"] == 0.0 and flat["ball_speed"] == flat["ball_velocity"]
    report.check("without loft the ball leaves as without Launch.fmu", same, "to the last bit")
    rising = np.diff([shot["backspin"] for shot in by_loft[0.4][:46]])
    claim = "the larger the loft, the larger the backspin, up to 45°"
    report.check(claim, bool(np.all(rising > 0.0)), "as the document says")
    slow, fast = (shots.shot(v, radians(11.5), ball="roh-lee") for v in (35.0, 50.0))
    claim = "the larger the club's speed, the larger the backspin"
    more = fast["backspin"] / slow["backspin"]
    report.check(claim, more > 1.0, f"{more:.3f} times as much at 50 m/s as at 35 m/s")

    def plot(figures, title, output, label, factor):
        figure, (left, right) = figures.new_pair(title)
        colours = figures.SKY, figures.ORANGE, figures.BLUE
        for (friction, row), colour in zip(by_loft.items(), colours):
            values = [shot[output] * factor for shot in row]
            left.plot(lofts, values, color=colour, label=f"friction {friction:g}")
        for (loft, row), dashes in zip(by_friction.items(), ("-", "--", ":")):
            values = [shot[output] * factor for shot in row]
            right.plot(frictions, values, color=figures.BLACK, ls=dashes, label=f"loft {loft:g}°")
        left.set(xlabel="spin loft (°)", ylabel=label)
        right.set(xlabel="friction", ylabel=label, ylim=(0, None))
        if output == "launch_angle":
            left.plot(lofts, lofts, color="0.5", ls=":", label="face normal")
        left.legend()
        right.legend()
        return figure

    @report.figure("loft_backspin", "At high loft the contact slips: friction limits the backspin.")
    def backspin(figures):
        return plot(figures, "Backspin at 40 m/s", "backspin", "backspin (rpm)", _RPM)

    @report.figure("loft_launch", "The ball leaves between path (0) and face normal (dotted).")
    def angle(figures):
        title, label = "Launch angle at 40 m/s, attack angle 0", "launch angle (°)"
        return plot(figures, title, "launch_angle", label, degrees(1.0))


def _show_assumptions(report, shots):
    """Backspin of three irons under other assumptions; the loft is that of the launch angle."""
    incremental = _RATIO * 2.0 * _EXPONENT / (_EXPONENT + 1.0)
    rows = []
    for stroke in (measured.PGA[club] for club in ("5-iron", "7-iron", "9-iron")):
        speed, attack, mass = stroke.club_speed, stroke.attack_angle, stroke.m_club
        given = speed, stroke.launch_angle, attack
        shot = shots.lofted(*given, m_club=mass)
        other = shots.lofted(*given, m_club=mass, tangential_stiffness_ratio=incremental)
        restitution, spin = shot["coefficient_of_restitution"], shot["backspin"]
        undamped = _undamped(restitution, speed, attack, stroke.launch_angle, mass)
        # With the lever arm r - d instead of r, of the torque and of the surface's speed.
        spin_loft = shot["dynamic_loft"] - attack
        u, _, force, _ = march(restitution, tan(spin_loft), mass)
        _, _, compression = shots.contact("penner", mass, speed * cos(spin_loft), u)
        arms = 1.0 - compression / _RADIUS
        _, _, shorter, _ = march(restitution, tan(spin_loft), mass, arms=arms)
        arm = spin * float(np.sum(arms * shorter) / np.sum(force))
        spins = spin, undamped, arm, other["backspin"]
        measured_spin = stroke.backspin
        cells = [f"{x * _RPM:.0f} {(x / measured_spin - 1.0) * 100.0:+.0f} %" for x in spins]
        rows.append([stroke.club, f"{measured_spin * _RPM:.0f}", *cells])
    title = "Backspin (rpm) under other assumptions, and its deviation from TrackMan's"
    columns = ["club", "TrackMan", "as is", "no damper", "arm r − d"]
    report.table(title, [*columns, f"κ = {incremental:.2f}"], rows)
    report.say(
        "What the agreement of the irons rests on: the tangential damper was adopted after the "
        "spring alone had missed them, fitted in the same way. The force acts with the lever arm "
        "r of the round ball; the column r − d, the compressed one's in the torque and in the "
        "surface's speed, is at the same loft. And the tangential stiffness is in proportion to "
        f"F/d: Mindlin's ratio 2/3 of the incremental stiffness n F/d is κ = {incremental:.2f}. "
        "The clubs of the tour beside measurements: scenario outside.",
    )


def _undamped(restitution, speed, attack, angle, m_club):
    """Backspin, rad/s, by a tangential spring without a damper, at the same launch angle (rad)."""

    def slope(loft):
        _, normal, tangential, _ = march(restitution, tan(loft - attack), m_club, False, steps=2000)
        return float(np.sum(tangential) / np.sum(normal))

    loft = bisect(lambda loft: loft - atan(slope(loft)) - angle, max(attack, 0.0), 0.9)
    ball_speed = (1.0 + restitution) * speed * cos(loft - attack) / (1.0 + _M_BALL / m_club)
    return ball_speed * slope(loft) / (0.4 * _RADIUS)


if __name__ == "__main__":
    main(__file__)
