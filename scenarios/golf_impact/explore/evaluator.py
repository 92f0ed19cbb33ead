"""What the page shows of a case: one function from values to paths, ranges, labels and readouts.

It needs the standard library only, so that it runs in an exported page, too.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import urlencode

#: Results of an impact without separation.
MAXIMA = ("max_force", "time_of_max_force", "max_compression", "compression_over_diameter")

NO_CONTACT = "No contact: the club never reaches the ball. It must be faster than the ball."
NO_SEPARATION = (
    "No separation: the bodies stay in contact (under law 1 a valid result of its drag)."
)

#: Communication points before touch, in contact, after it.
POINTS = (8, 100, 16)

#: Results that are plotted over one variable, and the number of its values.
SWEPT_METRICS = ("smash_factor", "coefficient_of_restitution")
SWEPT = 25

#: Parameters of Launch.fmu that are set here, and its inputs from the impact.
LOFT = ("dynamic_loft", "attack_angle", "friction")
FROM_IMPACT = ("ball_velocity", "club_velocity", "smash_factor", "coefficient_of_restitution")

#: Of the shot: outputs of Launch.fmu and BallFlight.fmu; points of the flight that is drawn.
LAUNCH = ("ball_speed", "launch_angle", "backspin")
FLIGHT = ("carry", "apex", "flight_time")
FLIGHT_POINTS = 30
NO_FLIGHT: dict[str, list[float]] = {"distance": [], "height": []}

#: Factors from SI to what is displayed; speeds are in the unit that the user chose.
_FACTORS = {
    **dict.fromkeys(("contact_time", "time_of_max_force"), 1e6),
    **dict.fromkeys(("energy_efficiency", "compression_over_diameter"), 100.0),
    "max_compression": 1e3,
    "launch_angle": 180.0 / math.pi,
    "backspin": 30.0 / math.pi,
}
_SPEEDS = ("ball_velocity", "club_velocity", "ball_speed", "head_speed")

#: Metric, label, decimals, unit, meaning.
READOUTS = (
    ("smash_factor", "S", 4, "", "smash factor: ball speed / club speed"),
    ("coefficient_of_restitution", "COR", 4, "", "separation speed / approach speed"),
    ("energy_efficiency", "E", 2, " %", "energy: ball {ball_share:.1%}, club {club_share:.1%}"),
    ("ball_velocity", "Ball", 2, " {speed}", "speed after impact"),
    ("club_velocity", "Club", 2, " {speed}", "speed after impact"),
    ("contact_time", "Contact time", 1, " µs", "from touch to separation"),
    ("max_force", "Peak force", 0, " N", "{time_of_max_force:.1f} µs after touch"),
    ("compression_over_diameter", "Max compression", 2, " %", "of D: {max_compression:.2f} mm"),
    ("contact_displacement_over_diameter", "Ball travel", 3, " D", "diameters, in contact"),
    ("momentum_final", "Momentum", 3, " N·s", "{momentum_kept:.2%} of that before"),
    ("launch_angle", "Launch angle", 1, "°", "ball speed at launch: {ball_speed:.2f} {speed}"),
    ("backspin", "Backspin", 0, " rpm", "head speed: {head_speed:.2f} {speed}"),
    ("carry", "Carry", 1, " m", "{yards:.0f} yd; apex {apex:.1f} m"),
)


class Evaluator:
    """Computes what the page shows, from its requests.

    Args:
        instances: of ClubBallImpact, Launch and BallFlight: `LoadedFmu` or `in_browser.Instance`.
        refusal: the exception that they raise where they refuse a value.
        facts: start values (`defaults`), outputs that are read (`metrics`, `path`), `speeds` by
            unit in m/s, `quantities` and `examples`.
    """

    def __init__(
        self, instances: Sequence[Any], refusal: type[Exception], facts: Mapping[str, Any]
    ) -> None:
        self.instance, self.launch, self.flight = instances
        self.refusal, self.facts = refusal, facts
        self.defaults: dict[str, float] = facts["defaults"]

    def __call__(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Evaluate a request.

        Args:
            request: `values`, inputs and parameters by name (SI; start values for the others),
                numbers or text; `unit` of speeds; `over`, the variable over which S and COR are
                computed, instead of the impact.

        Returns:
            A dictionary for JSON; `refused`, a sentence, and `about`, the variable concerned, where
            the values can't be used.
        """
        try:
            values = self._values(request.get("values") or {})
            if over := request.get("over"):
                return self.sweep(values, str(over))
            return self.impact(values, request.get("unit") or "m/s")
        except (self.refusal, ValueError, OverflowError) as error:
            about = str(error).partition(" ")[0]
            return {"refused": str(error), "about": about if about in self.defaults else ""}

    def _values(self, changes: Mapping[str, Any]) -> dict[str, float]:
        values = dict(self.defaults)
        for name, value in changes.items():
            if name not in values:
                known = ", ".join(values)
                raise ValueError(f"There is no input or parameter {name}: choose from {known}.")
            try:
                values[name] = float(value)
            except (TypeError, ValueError):
                raise ValueError(f"{name} = {value!r} is not a number") from None
        return values

    def metrics(self, values: Mapping[str, float]) -> dict[str, float]:
        """Metrics of an impact, in one communication step, by the names of results.json."""
        instance, v = self.instance, values
        instance.start(**_without_loft(values))
        closing = v["club_speed"] - v["ball_speed"]
        approach = v["gap"] / closing if closing > 0.0 else 0.0
        # Over within the step, unless it takes longer than 30 years.
        instance.step(0.0, min(1.0 + 20.0 * _half_period(v) + approach, 1e9))
        m = instance.read(self.facts["metrics"])
        if not all(map(math.isfinite, m.values())):
            raise ValueError("This impact leaves the range of double precision.")
        diameter = v["ball_diameter"]
        m["contact_displacement_over_diameter"] = m["contact_displacement"] / diameter
        m["compression_over_diameter"] = m["max_compression"] / diameter
        m["momentum_initial"] = v["m_club"] * v["club_speed"] + v["m_ball"] * v["ball_speed"]
        m["momentum_final"] = m["momentum"]
        m["momentum_kept"] = _ratio(m["momentum"], m["momentum_initial"])
        initial = sum(_energy(v[f"m_{body}"], v[f"{body}_speed"]) for body in ("club", "ball"))
        m["kinetic_energy_initial"], m["kinetic_energy_final"] = initial, m["kinetic_energy"]
        for body in ("club", "ball"):
            left = _energy(v[f"m_{body}"], m[f"{body}_velocity"])
            m[f"{body}_share"] = _ratio(left, initial)
        return m

    def impact(self, values: dict[str, float], unit: str) -> dict[str, Any]:
        """Everything that is shown of a case; speeds as text and as `…_shown` are in the unit."""
        metrics = self.metrics(values)
        touched, separated = map(self.instance.read_flag, ("touched", "separated"))
        size = self.facts["speeds"][unit]
        path = self._path(values, metrics, touched, separated, size)
        # Without separation there are maxima only, without contact nothing.
        valid = metrics if separated else {name: metrics[name] for name in MAXIMA if touched}
        shot, flight, problem = self.shot(values, metrics) if separated else ({}, NO_FLIGHT, "")
        cases = (*self.facts["examples"], *self.facts["clubs"])
        same = [one for one in cases if values == self.defaults | one["values"]]
        example: Mapping[str, Any] = same[0] if same else {}
        changed = {name: x for name, x in values.items() if x != self.defaults[name]}
        texts = {name: repr(x).removesuffix(".0") for name, x in changed.items()}
        # Without a parameter the page opens, and `golf-impact run` runs, something else.
        given = _without_loft(texts) or {"law": "1"}
        return {
            "values": values,
            "query": urlencode(given | texts),
            "path": path,
            "metrics": metrics | shot,
            "flight": flight,
            "example": example.get("name", ""),
            # `run` has no loft.
            "command": " --set ".join(["golf-impact run", *map("=".join, given.items())]),
            "ranges": _ranges(path, metrics, values, shot),
            "readouts": _readouts(valid | shot, example, unit, size),
            "hint": example.get("hint", ""),
            "peak": f"{metrics['max_force']:.0f} N" if touched else "",
            "area": _area(metrics, values["law"]) if touched else "no contact",
            "state": problem if separated else NO_SEPARATION if touched else NO_CONTACT,
        }

    def shot(
        self, values: Mapping[str, float], metrics: Mapping[str, float]
    ) -> tuple[dict[str, float], dict[str, list[float]], str]:
        """Launch and flight: metrics, curve (m), and why there is none."""
        v, masses = values, {"m_ball": values["m_ball"], "ball_diameter": values["ball_diameter"]}
        try:
            self.launch.start(**masses, m_club=v["m_club"], **{name: v[name] for name in LOFT})
            self.launch.set({**{name: metrics[name] for name in FROM_IMPACT}, "separated": True})
            self.launch.step(0.0, 1e-3)
            launch = self.launch.read(LAUNCH)
            speed = {"ball_velocity": launch["ball_speed"], "separated": True}
            self.flight.start(**masses)
            self.flight.set({**speed, **{name: launch[name] for name in LAUNCH[1:]}})
            self.flight.step(0.0, time := 1e-6)
            shot = {**launch, **self.flight.read(FLIGHT)}
            rows = [{"distance": 0.0, "height": 0.0}]
            for n in range(1, FLIGHT_POINTS + 1 if shot["flight_time"] > 1e-3 else 1):
                end = shot["flight_time"] * n / FLIGHT_POINTS
                self.flight.step(time, end - time)
                time = end
                rows.append(self.flight.read(("distance", "height")))
        except (self.refusal, ValueError, OverflowError) as error:
            return {}, NO_FLIGHT, f"No flight: {error}"
        shot["head_speed"] = v["club_speed"] / math.cos(v["dynamic_loft"] - v["attack_angle"])
        flight = {name: [row[name] for row in rows] for name in ("distance", "height")}
        return shot, flight, ""

    def sweep(self, values: Mapping[str, float], over: str) -> dict[str, Any]:
        """S and COR over one variable; None where it is refused or there is no separation."""
        q = next((q for q in self.facts["quantities"] if q["name"] == over), None)
        if q is None or not q["step"]:
            raise ValueError(f"S and COR can't be shown over {over}.")
        low, high = q["low"] * q["scale"], q["high"] * q["scale"]
        xs = [low + n / (SWEPT - 1) * (high - low) for n in range(SWEPT)]
        swept: dict[str, Any] = {"x": xs, **{name: [None] * SWEPT for name in SWEPT_METRICS}}
        for n, x in enumerate(xs):
            try:
                metrics = self.metrics({**values, over: x})
            except (self.refusal, ValueError, OverflowError):
                continue
            if self.instance.read_flag("separated"):
                for name in SWEPT_METRICS:
                    swept[name][n] = metrics[name]
        return {"swept": swept, "over": over}

    def check(self) -> dict[str, Any]:
        """How far the metrics of the examples are from those that the facts carry (`check`)."""
        errors = []
        for example in self.facts["examples"]:
            metrics = self({"values": example["values"]})["metrics"]
            for name, expected in example["check"].items():
                errors.append(abs(metrics[name] - expected) / (abs(expected) or 1.0))
        return {"count": len(errors), "worst": max(errors)}

    def _path(
        self,
        values: dict[str, float],
        metrics: dict[str, float],
        touched: bool,
        separated: bool,
        size: float,
    ) -> dict[str, list[float]]:
        contact = metrics["contact_time"] if separated else _half_period(values)
        if touched and not separated:
            contact *= 10.0  # the time in which the contact develops
        end = nice(1.15 * contact)
        # The approach is shown too, for any gap of the case.
        lead = 0.1 * end
        if touched:
            values = {**values, "gap": (values["club_speed"] - values["ball_speed"]) * lead}
        host = sorted(
            {0.0, *(lead + t for t in _times(contact, end, metrics["time_of_max_force"]))}
        )
        if len(host) < sum(POINTS) - 1 or host[-1] + lead == host[-1]:
            raise ValueError(f"A contact of {contact:g} s is too short or too long to be drawn.")
        self.instance.start(**_without_loft(values))
        rows, point = [], 0.0
        for instant in host:
            if instant:
                self.instance.step(point, instant - point)
            point = instant
            rows.append({"time": instant - lead, **self.instance.read(self.facts["path"])})
            _complete(rows[-1], values, values["ball_speed"] * lead, size)
        return {name: [row[name] for row in rows] for name in rows[0]}


def _complete(row: dict[str, float], v: Mapping[str, float], moved: float, size: float) -> None:
    """Add to one instant of the path: where the energy is (J), shapes of the bodies (m), speeds.

    The spring's energy is ∫ k d_r (d/d_r)^n dd. The ball is an ellipse that keeps its volume when
    it is compressed. Positions are those since touch, until which the ball has `moved`.
    """
    initial = left = 0.0
    for body in ("club", "ball"):
        initial += _energy(v[f"m_{body}"], v[f"{body}_speed"])
        row[f"{body}_energy"] = _energy(v[f"m_{body}"], row[f"{body}_velocity"])
        left += row[f"{body}_energy"]
        row[f"{body}_shown"] = row[f"{body}_velocity"] / size
        row[f"{body}_position"] -= moved
    n, length, diameter = v["exponent"], v["reference_compression"], v["ball_diameter"]
    spring = v["k"] * length**2 / (n + 1.0) * (row["compression"] / length) ** (n + 1.0)
    row |= {"spring_energy": spring, "lost_energy": initial - left - spring}
    width = max(diameter - row["compression"], 0.02 * diameter)
    row["ball_middle"] = row["ball_position"] + diameter - 0.5 * width
    row |= {"ball_width": width, "ball_height": diameter * math.sqrt(diameter / width)}
    row |= {"club_back": row["club_position"] - 0.72 * diameter, "club_height": 1.2 * diameter}


def _without_loft(values: Mapping[str, Any]) -> dict[str, Any]:
    """Those of ClubBallImpact."""
    return {name: value for name, value in values.items() if name not in LOFT}


def _energy(mass: float, speed: float) -> float:
    return 0.5 * mass * speed * speed


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else 0.0


def nice(limit: float) -> float:
    """The next of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten: the end of an axis."""
    if not 0.0 < limit < math.inf:
        return 1.0
    power = 10.0 ** math.floor(math.log10(limit))
    steps = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
    return next((step * power for step in steps if step * power >= limit), 10.0 * power)


def _half_period(values: Mapping[str, float]) -> float:
    """The contact time without damping of a linear contact, s: π √(μ/k)."""
    mu = 1.0 / (1.0 / values["m_club"] + 1.0 / values["m_ball"])
    return math.pi * math.sqrt(mu / values["k"])


def _times(contact: float, end: float, peak: float) -> list[float]:
    """Instants since touch, s: equally spaced before and after contact, closer at both its ends."""
    before, within, after = POINTS
    close = 1e-6 * contact
    shares = [n / (within - 1) for n in range(within)]
    times = [contact * (0.5 * s + 0.25 * (1.0 - math.cos(math.pi * s))) for s in shares]
    times[0] = close
    times += [-close - n / (before - 1) * (0.1 * end - close) for n in range(before - 1)]
    times += [contact + n / (after - 1) * (end - contact) for n in range(1, after)]
    return [*times, peak]


def _ranges(
    path: Mapping[str, list[float]],
    metrics: Mapping[str, float],
    values: Mapping[str, float],
    shot: Mapping[str, float],
) -> dict[str, list[float]]:
    """Ends of the axes, by what they show."""

    def both(what: str) -> list[float]:
        columns = [*path[f"club_{what}"], *path[f"ball_{what}"]]
        low = min(columns)
        return [-nice(-1.05 * low) if low < 0.0 else 0.0, nice(1.05 * max(columns))]

    end, height = path["time"][-1], 1.35 * values["ball_diameter"]
    return {
        "time": [-0.1 * end, end],
        "force": [0.0, nice(1.12 * metrics["max_force"])],
        "compression": [0.0, nice(1.05 * metrics["max_compression"])],
        "energy": [0.0, nice(1.02 * metrics["kinetic_energy_initial"])],
        "velocity": both("shown"),
        "position": both("position"),
        "distance": [0.0, nice(1.02 * shot.get("carry", 0.0))],
        "height": [0.0, nice(1.2 * shot.get("apex", 0.0))],
        "scene_width": [-1.96 * height, 5.04 * height],
        "scene_height": [-0.5 * height, 0.5 * height],
    }


def _readouts(
    metrics: Mapping[str, float], example: Mapping[str, Any], unit: str, size: float
) -> list[dict[str, str]]:
    """Each metric as text, with what is published of the example that the case may be."""
    factors = {**_FACTORS, **dict.fromkeys(_SPEEDS, 1.0 / size)}
    m = {name: value * factors.get(name, 1.0) for name, value in metrics.items()}
    rows = []
    for metric, label, decimals, shown_in, meaning in READOUTS:
        rows.append({"metric": metric, "label": label, "meaning": "", "value": "–", "printed": ""})
        if metric not in m:
            continue
        shown_in = shown_in.format(speed=unit)
        rows[-1]["meaning"] = meaning.format(**m, yards=m.get("carry", 0.0) / 0.9144, speed=unit)
        rows[-1]["value"] = f"{m[metric]:.{decimals}f}{shown_in}"
        if text := example.get("printed", {}).get(metric):
            if metric in _SPEEDS:
                text = f"{float(text) / size:.{len(text.partition('.')[2])}f}"
            rows[-1]["printed"] = f"{example['source']}: {text}{shown_in}"
    return rows


def _area(metrics: Mapping[str, float], law: float) -> str:
    lost = max(metrics["kinetic_energy_initial"] - metrics["kinetic_energy_final"], 0.0)
    texts = {1.0: f"no loop: F = k d.\nThe drag takes {lost:.2f} J"}
    texts[2.0] = f"loop area: {lost:.2f} J,\nthe energy lost"
    # Of another law only the results are known.
    return texts.get(law, f"{lost:.2f} J of kinetic energy lost")
