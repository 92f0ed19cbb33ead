"""Predictions beside published data that no parameter of the project was fitted to."""

from math import asin, cos, exp, inf, pi, radians, sin

import numpy as np

from golf_impact.scenario import BALLS, HEAD, Report, loaded_shots, main, measured

TITLE = "Outside: predictions beside data that nothing was fitted to"
CHAPTER = 16

#: Start values of the FMUs: mass of the ball (kg), its radius (m); air (kg/m3, m2/s), gravity
#: (m/s2), and loss of spin.
_M_BALL, _RADIUS = 0.04593, 0.5 * 0.04267
_DENSITY, _VISCOSITY, _GRAVITY, _DECAY = 1.225, 1.48e-5, 9.80665, 2e-5

_RPM = 30.0 / pi
_SETS = measured.OUTSIDE["sets"]
_STROKES = list(measured.PGA.values())

#: Aims of the flight: rms of carry, largest deviation of apex (%) and of land angle (degrees).
_AIMS = 3.5, 10.0, 3.0


def run(fmu):
    """Clubs of the tour: impact, flight from the measured launch; sets of coefficients; others."""
    report = Report(TITLE, fmu)
    with loaded_shots(fmu) as shots:
        impacts = _show_impacts(report, shots)
        flights = _show_flights(report, shots)
        _show_sets(report, flights)
        _show_others(report, shots)
        _show_tour_ball(report, shots)
    pga = measured.OUTSIDE["pga"]
    report.say(f"Clubs: {pga['source']}. {pga['trust']} Head masses: {pga['masses']}.")

    @report.figure("outside", "Nothing is fitted but the irons' and woods' loft. Bands: the aims.")
    def plot(figures):
        figure, (left, right) = figures.new_pair("Model less TrackMan's PGA Tour averages, 2023")
        rows, clubs = range(len(_STROKES)), [stroke.club for stroke in _STROKES]
        figures.label_rows(left, clubs, 10.0)
        figures.label_rows(right, clubs, _AIMS[2])
        for label, column, marker, colour in (
            ("backspin", impacts[:, 0], "o", figures.VERMILION),
            ("ball speed", impacts[:, 1], "s", figures.BLUE),
            ("carry, from the measured launch", flights[:, 0], "^", figures.GREEN),
            ("apex, likewise", flights[:, 1], "v", figures.ORANGE),
        ):
            left.plot(column, rows, marker, color=colour, label=label)
        right.plot(flights[:, 2], rows, "D", color=figures.SKY)
        left.plot([], [], "D", color=figures.SKY, label="land angle, likewise")
        left.set(xlabel="deviation (%)")
        right.set(xlabel="deviation (degrees)")
        figures.add_legend_below(figure, left, columns=3)
        return figure

    return report


def _show_impacts(report, shots):
    """Backspin and ball speed (deviations in %, shape (12, 2)); the loft is from the launch."""
    rows, found, ratios, shares = [], [], [], []
    for club, speed, path, ball_speed, angle, backspin, *_, mass in _STROKES:
        report.cases[club] = shot = shots.lofted(speed, angle, path, m_club=mass)
        found.append([shot["backspin"] / backspin, shot["ball_speed"] / ball_speed])
        shares.append((angle - path) / (shot["dynamic_loft"] - path) * 100.0)
        # Without a contact law, for a homogeneous ball.
        across = 0.4 * _RADIUS * backspin
        loft = angle + asin(across / ball_speed)
        rolling = speed * sin(loft - path) / (3.5 + _M_BALL / mass)
        ratios.append(across / rolling)
        restitution = shot["coefficient_of_restitution"]
        lofts = map(_degrees, (shot["dynamic_loft"], loft))
        went_in = [f"{mass * 1e3:.0f}", f"{restitution:.3f}", *lofts]
        spin, ball = (x - 1.0 for x in found[-1])
        out = [f"{shot['backspin'] * _RPM:.0f}", f"{spin * 100.0:+.0f}"]
        out += [f"{shot['ball_speed'] / measured.MPH:.0f}", f"{ball * 100.0:+.0f}"]
        rows.append([club, *went_in, *out, f"{ratios[-1]:.2f}"])
    title = (
        "Impact: mass, COR line of penner, friction 0.4, κ 2/3 and loft went in; backspin and ball "
        "speed came out. The loft is that of the row's launch angle, so launch is not predicted; "
        "loft* = launch + asin(v_t/v), v_t = 0.4 r ω, and v_t over that of rolling, v sin(spin "
        "loft)/(3.5 + m_B/m_C), need no contact law."
    )
    columns = ["club", "g", "COR", "loft", "loft*", "rpm", "%", "mph", "%", "v_t / rolling"]
    report.table(title, columns, rows)
    deviations = (np.array(found) - 1.0) * 100.0
    claim = "the backspin of irons is within -5 and +20 % of TrackMan's"
    spin = deviations[:, 0]
    report.check(claim, spin[4:].min() > -5.0 and spin[4:].max() < 20.0, _range(spin[4:]))
    report.check("the driver's isn't", spin[0] > 50.0, f"{spin[0]:+.0f} %")
    claim = "TrackMan's driver leaves with less backspin than a ball that rolls, irons with more"
    driver, least = ratios[0], min(ratios[4:])
    report.check(claim, driver < 1.0 < least, f"{driver:.2f}; {least:.2f} and up")
    report.say(
        f"Impact: the irons' backspin deviates by {_range(spin[4:])} %, the woods' by "
        f"{_range(spin[:4])} %, ball speed by {_range(deviations[:, 1])} % (woods have a flexible "
        "face, the ball penner a rigid one). A ball that rolls at separation has a ratio of 1: "
        f"TrackMan's driver has {driver:.2f}, the short irons up to {max(ratios):.2f}. More "
        "than 1 takes a tangential rebound, or a speed or loft that the averages don't give. "
        f"The ball leaves {min(shares):.0f} to {max(shares):.0f} % of the way from the path to the "
        "face normal (PING: 61 to 83 %, horizontally, Proceedings 2018, 2(6), 249)."
    )
    return deviations


def _show_flights(report, shots):
    """Deviations of carry, apex (%) and land angle (degrees) by BallFlight.fmu, shape (12, 3)."""
    rows, found = [], []
    for stroke in _STROKES:
        flight = shots.fly(stroke.ball_speed, stroke.launch_angle, stroke.backspin)
        found.append(_deviations(stroke, flight["carry"], flight["apex"], flight["land_angle"]))
        lengths = [f"{flight[one] / measured.YARD:.0f}" for one in ("carry", "apex")]
        values = [*lengths, _degrees(flight["land_angle"])]
        signed = [f"{x:+.1f}" for x in found[-1]]
        rows.append([stroke.club, *(cell for pair in zip(values, signed) for cell in pair)])
    title = "Flight from the measured launch (ball speed, angle, backspin), and its deviation"
    columns = ["club", "carry (yd)", "%", "apex (yd)", "%", "land (°)", "°"]
    report.table(title, columns, rows)
    deviations = np.array(found)
    carry = _rms(deviations[:, 0])
    report.check("rms of carry is at most 3.5 %", carry <= _AIMS[0], f"{carry:.2f} %")
    low, high = min(deviations[:, 1]), max(deviations[:, 1])
    claim = "apex is within 11 %, in all rows but one within 10 %"
    beyond = int(np.sum(np.abs(deviations[:, 1]) > _AIMS[1]))
    report.check(claim, -11.0 < low < high < 10.0 and beyond <= 1, f"{_range(deviations[:, 1])} %")
    claim = "the ball lands too flat in every row: the aim of 3 degrees is not met"
    report.check(claim, deviations[:, 2].max() < 0.0, f"{_range(deviations[:, 2])} degrees")
    return deviations


def fly(drag, lift, decay=_DECAY, size=0.01):
    """Flights of the clubs of the tour by Runge-Kutta steps: another method than BallFlight's.

    C_D and C_L are functions of spin ratio, Reynolds number / 100,000 and whether the ball
    descends, arrays of shape (12,). Returns carry, apex (m) and land angle (rad), shape (12, 3).
    """
    speed, angle, spin = np.array([[s.ball_speed, s.launch_angle, s.backspin] for s in _STROKES]).T
    k = 0.5 * _DENSITY * pi * _RADIUS**2 / _M_BALL

    def slope(state):
        _, _, u, h, w = state
        v = np.hypot(u, h)
        arguments = _RADIUS * w / v, 2.0 * _RADIUS * v / _VISCOSITY / 1e5, h < 0.0
        d, c = k * v * drag(*arguments), k * v * lift(*arguments)
        return np.array([u, h, -d * u - c * h, c * u - d * h - _GRAVITY, -decay * v * w / _RADIUS])

    start = [0.0 * speed, 0.0 * speed, speed * np.cos(angle), speed * np.sin(angle), spin]
    path = [np.array(start)]
    while np.any(path[-1][1] >= 0.0):
        one = slope(state := path[-1])
        two = slope(state + 0.5 * size * one)
        three = slope(state + 0.5 * size * two)
        four = slope(state + size * three)
        path.append(state + size / 6.0 * (one + 2.0 * two + 2.0 * three + four))
    whole = np.array(path)
    found = []
    for x, y, u, h in whole[:, :4].transpose(2, 1, 0):
        n = 1 + int(np.argmax(y[1:] < 0.0))
        part = y[n - 1] / (y[n - 1] - y[n])
        carry, across, down = (one[n - 1] + part * (one[n] - one[n - 1]) for one in (x, u, h))
        found.append([carry, y.max(), np.arctan2(-down, across)])
    return np.array(found)


def published():
    """The sets by what they are: C_D and C_L as functions for `fly`, and the loss of spin."""
    (drag, lift), naruo = (
        [_polynomial(_SETS[name][one], _SETS[name]["spin_ratio_limit"]) for one in ("drag", "lift")]
        for name in ("ferguson", "naruo")
    )

    def usga(limit, terms=1.0):
        one = _SETS["usga"]
        return (
            _polynomial(one["drag"], limit, terms * one["drag_reynolds"]),
            _polynomial(one["lift"], limit, terms * one["lift_reynolds"], -2.0),
        )

    sets = {
        "Ferguson 2022 (default)": (drag, lift),
        "spin lost twice as fast": (drag, lift, 2.0 * _DECAY),
        "USGA 2001, S ≤ 0.22": usga(0.22),
        "USGA, S ≤ 0.30": usga(0.30),
        "USGA, no Reynolds terms": usga(0.22, 0.0),
        "Smits & Smith 1994": (
            lambda s, r, _: 0.24 + 0.18 * s + 0.06 * np.sin(0.5 * pi * (r - 0.9)),
            lambda s, r, _: 0.54 * s**0.4,
        ),
        "Smits, no Reynolds term": (lambda s, r, _: 0.24 + 0.18 * s, lambda s, r, _: 0.54 * s**0.4),
        "Bearman & Harvey 1976": [_measured(_SETS["bearman"], one) for one in ("drag", "lift")],
        "Naruo 2004": naruo,
        "Lyu 2018": (
            # Two fits, which cross at 0.81.
            lambda s, r, _: np.where(
                r < 0.81, 1.29 * r**2 - 2.59 * r + 1.50, 0.191 * r**2 - 0.540 * r + 0.56
            ),
            _polynomial([0.0, 1.99, -3.25], 0.306),
        ),
    }
    modern = (
        lambda s, r, _: (
            np.where(s < 0.22, 0.220 - 0.27 * s + 3.0 * s**2, 0.222 + 0.38 * np.minimum(s, 0.64))
            + 0.0135 * (np.maximum(r, 1.0) - 1.5)
        ),
        lambda s, r, _: np.where(s < 0.3, 0.065 + 0.85 * s, np.minimum(0.45, 0.245 + 0.25 * s)),
    )
    remaining, added = _crisis(_SETS["crisis"])
    less, slower = (_SETS["descent"][one] for one in ("lift", "drag"))

    def slow(drag, lift):
        return (
            lambda s, r, down: drag(s, r, down) + added(s, r),
            lambda s, r, down: lift(s, r, down) * remaining(s, r),
        )

    def changed(c, factor):
        return lambda s, r, down: c(s, r, down) * np.where(down, factor, 1.0)

    return sets | {
        "modern balls": modern,
        "modern, Lyu 2020": slow(*modern),
        "default, Lyu 2020": slow(drag, lift),
        "default, TrackMan 2016": (changed(drag, slower), changed(lift, less)),
        "its loss of lift alone": (drag, changed(lift, less)),
    }


def _polynomial(coefficients, limit, factor=0.0, power=1.0):
    """Of the spin ratio, held at its limit, and a term with a power of the Reynolds number."""
    value = np.polynomial.polynomial.polyval
    return lambda s, r, _: value(np.minimum(s, limit), coefficients) + factor * r**power


def _bilinear(table, rows, columns):
    """A function of row and column, arrays (n,); held at the table's ends."""

    def value(row, column):
        lines = np.array([np.interp(column, columns, line) for line in table]).T
        return np.array([np.interp(one, rows, line) for one, line in zip(row, lines)])

    return value


def _measured(one, name):
    """Bearman & Harvey's, over backspin and speed of a ball at the same S and Reynolds number."""
    at = _bilinear(one[name], one["spins"], one["speeds"])

    def value(s, r, _):
        speed = r * 1e5 * _VISCOSITY / (2.0 * _RADIUS)
        return at(s * speed / _RADIUS * _RPM, speed)

    return value


def _crisis(one):
    """The lift that remains at low Reynolds numbers, and the drag that is added."""
    at = _bilinear(one["lift"], one["reynolds"], one["ratios"])
    ends = [one["measured_to"], one["gone_at"]], [1.0, 0.0]
    return (
        lambda s, r: 1.0 - (1.0 - at(r, s)) * np.interp(s, *ends),
        lambda s, r: np.interp(r, one["drag_reynolds"], one["drag"]) * np.interp(s, *ends),
    )


def _show_sets(report, flights):
    """Every set of coefficients that was tried, on the same launches."""
    rows, found = [], {}
    for name, one in published().items():
        each = [_deviations(stroke, *row) for stroke, row in zip(_STROKES, fly(*one))]
        found[name] = deviations = np.array(each)
        cells = [
            f"{_rms(column):.1f} ({min(column):+.{digits}f}…{max(column):+.{digits}f})"
            for column, digits in zip(deviations.T, (0, 0, 1))
        ]
        rows.append([name, *cells])
    title = "C_D and C_L that were tried, none of them fitted here: rms (range) of the deviations"
    report.table(title, ["set", "carry (%)", "apex (%)", "land (°)"], rows)
    ours = next(iter(found.values()))
    error = float(np.abs(ours - flights).max())
    claim = "Runge-Kutta steps agree with BallFlight.fmu, in % and degrees"
    report.check_close(claim, error, 0.0, 2e-3, "linear interpolation within a step of 10 ms")
    met = [
        name
        for name, m in found.items()
        if _rms(m[:, 0]) <= _AIMS[0] and all(np.abs(m[:, n]).max() <= _AIMS[n] for n in (1, 2))
    ]
    claim = "no set meets all aims: carry rms 3.5 %, apex within 10 %, land angle within 3 degrees"
    report.check(claim, not met, ", ".join(met))
    low = found["default, Lyu 2020"][:, 2].min()
    report.say(
        "Flight: no set has both the carry and the land angle. That of Ferguson et al. is "
        "BallFlight's: of a ball of today, up to the spin ratios of irons, with the smallest "
        "deviations of carry and apex together. Bearman & Harvey's ball comes as near, but is a "
        "table that ends at 6000 rpm. Some of the missing land angle is lift that modern balls "
        "lose below a Reynolds number of 75,000, which irons reach after the apex: with it the "
        f"worst row has {low:+.1f} instead of {ours[:, 2].min():+.1f} degrees. It isn't built in, "
        "since these data end at S 0.36, and irons land at 0.4 to 1. TrackMan's own loss "
        "of lift in the descent without its loss of drag would do the rest, at the cost of carry.",
        *(f"{name}: {one['source']}." for name, one in _SETS.items()),
    )


def _deviations(stroke, carry, apex, land):
    lengths = carry / stroke.carry, apex / stroke.apex
    return [*((x - 1.0) * 100.0 for x in lengths), np.degrees(land - stroke.land_angle)]


def air_density(altitude, temperature, humidity=0.0):
    """Of moist air, kg/m3, at altitude (m), temperature (degrees Celsius) and humidity (0 to 1).

    Pressure: ICAO's standard atmosphere, ISO 2533. Vapour: A. L. Buck, J. Appl. Meteorol. 20 (1981)
    1527, with the coefficients of 1996.
    """
    pressure = 101_325.0 * (1.0 - 2.25577e-5 * altitude) ** 5.25588
    t = temperature
    vapour = humidity * 611.21 * exp((18.678 - t / 234.5) * t / (257.14 + t))
    return (pressure - 0.378 * vapour) / (287.05 * (t + 273.15))


def _show_others(report, shots):
    """Single results: altitude, contact at other speeds, gear effect."""
    driver = measured.PGA["driver"]
    launch = np.array([driver.ball_speed, driver.launch_angle, driver.backspin])
    high = air_density(2377.44, 15.0)
    changes = []
    for rho, less, shift in (
        (1.225, high, [0.0, 0.0, 0.0]),
        (0.992 * 1.184, 0.804 * 1.184, [1.5 * measured.MPH, radians(1.2), -21.0 / _RPM]),
    ):
        low = shots.fly(*launch, air_density=rho)
        up = shots.fly(*(launch + shift), air_density=less)
        changes.append([(up[one] / low[one] - 1.0) * 100.0 for one in ("carry", "apex")])
        changes[-1].append(np.degrees(up["land_angle"] - low["land_angle"]))
    penner = {**BALLS["penner"].values, "m_club": 0.200}
    outputs = ("contact_time", "max_compression", "max_force", "coefficient_of_restitution")
    putt, slower, fast = (
        shots.fmu.impact(outputs, **penner | {"club_speed": speed})
        for speed in (2.0, 110.0 * measured.MPH, 120.0 * measured.MPH)
    )
    stroke = driver.club_speed, driver.launch_angle, driver.attack_angle
    head = {"m_club": HEAD}
    turning = shots.lofted(*stroke, **head, height=0.0)
    loft = turning["dynamic_loft"]
    gear = []
    for roll in (inf, 0.254, 0.305, 0.330):
        below, above = (
            shots.shot(stroke[0], loft + asin(h / roll), stroke[2], height=h, **head)["backspin"]
            for h in (-0.0127, 0.0127)
        )
        gear.append((above - below) * _RPM / 25.4)
    model = {
        "cor": slower["coefficient_of_restitution"],
        "putt": putt["coefficient_of_restitution"],
        "contact_time": fast["contact_time"] * 1e6,
        "compression": fast["max_compression"] / (2.0 * _RADIUS) * 100.0,
        "force": fast["max_force"] / 1e3,
        "driver": turning["backspin"] * _RPM,
        **dict(zip(("gear", "gear_254", "gear_305", "gear_330"), gear)),
        **dict(zip(("high_carry", "high_apex", "high_land"), changes[0])),
        **dict(zip(("pines_carry", "pines_apex"), changes[1])),
    }
    rows = []
    for one in measured.OUTSIDE["others"]:
        x, value, unit = model[one["model"]], one["value"], one["unit"]
        relative = f"{(x / value - 1.0) * 100.0:+.0f} %"
        deviation = f"{x - value:+.1f} {unit}" if unit in ("%", "°") else relative
        ours = f"{x:.3g}" if abs(x) < 100.0 else f"{x:.0f}"
        rows.append([one["what"], one["given"], f"{value:g} {unit}", ours, deviation])
        if one["source"] != "the same":
            report.say(f"{one['what']}: {one['source']}; {one['trust']}.")
    report.table("Other data", ["", "went in", "published", "model", "deviation"], rows)
    report.cases["others"] = {name: float(x) for name, x in model.items()}


def _show_tour_ball(report, shots):
    """The COR that TrackMan's own speeds of the driver need, and the ball tour fitted to them."""
    rows = []
    drives = {"earlier": measured.TOUR[0], "2023": measured.OUTSIDE["pga"]["rows"][0]}
    for year, (_, mph, attack, ball, launch, rpm, *_) in drives.items():
        below = asin(0.4 * _RADIUS * rpm / _RPM / (ball * measured.MPH))
        path, loft = radians(attack), radians(launch) + below
        normal = ball * cos(below) / (mph * cos(loft - path))
        needed = [normal * (1.0 + _M_BALL / mass) - 1.0 for mass in (0.200, 0.210)]
        speed = mph * measured.MPH
        ours = shots.shot(speed, loft, path, ball="tour")["ball_speed"] / speed
        cells = [_degrees(loft - path), f"{ball / mph:.3f}", f"{ours:.3f}"]
        rows.append([year, *cells, *(f"{cor:.3f}" for cor in needed)])
    title = "The ball tour (S 1.478 without loft) in TrackMan's drives, spin loft by v_t = 0.4 r ω"
    columns = ["", "spin loft (°)", "S, TrackMan", "S, tour", "COR needed, 200 g", "210 g"]
    report.table(title, columns, rows)
    least = min(float(cell) for row in rows for cell in row[4:])
    claim = "TrackMan's speeds of the driver need a COR above the rules' limit of 0.83"
    report.check(claim, least > 0.83, f"{least:.3f} at least")
    report.say(
        "The ball tour is fitted along the face normal. With the spin loft of the drive it gives "
        "less than TrackMan's S; a COR that gives it is above the rules' limit. So head speed or "
        "effective mass is defined differently there; the difference isn't fitted away.",
    )


def _degrees(angle):
    return f"{np.degrees(angle):.1f}"


def _rms(column):
    return float(np.sqrt(np.mean(column**2)))


def _range(column):
    return f"{min(column):+.1f} to {max(column):+.1f}"


if __name__ == "__main__":
    main(__file__)
