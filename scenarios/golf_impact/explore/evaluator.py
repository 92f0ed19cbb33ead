"""What the page shows of a case: one function from values to paths, ranges, labels and readouts.

It needs the standard library only, so that it runs in an exported page, too.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any
from urllib.parse import urlencode

#: Results of an impact without separation.
MAXIMA = ("max_force", "time_of_max_force", "max_compression", "compression_over_diameter")

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

_DEGREE = math.pi / 180.0

#: Metric, label, format of the value, meaning. Numbers are in the displayed units.
READOUTS = (
    ("smash_factor", "S", "{:.4f}", "smash factor: ball speed / club speed"),
    ("coefficient_of_restitution", "COR", "{:.4f}", "separation speed / approach speed"),
    ("energy_efficiency", "E", "{:.2%}", "energy: ball {ball_share:.1%}, club {club_share:.1%}"),
    ("ball_velocity", "Ball", "{:.2f} {speed}", "speed after impact"),
    ("club_velocity", "Club", "{:.2f} {speed}", "speed after impact"),
    ("contact_time", "Contact time", "{:.1f} µs", "from touch to separation"),
    ("max_force", "Peak force", "{:.0f} N", "{time_of_max_force:.1f} µs after touch"),
    ("compression_over_diameter", "Max compression", "{:.2%}", "of D: {max_compression:.2f} mm"),
    ("contact_displacement_over_diameter", "Ball travel", "{:.3f} D", "diameters, in contact"),
    ("momentum_final", "Momentum", "{momentum_kept:.2%}", "kept of {momentum_initial:.3f} N·s"),
)
SHOT_READOUTS = (
    ("launch_angle", "Launch angle", "{:.1f}°", "ball speed at launch: {ball_speed:.2f} {speed}"),
    ("backspin", "Backspin", "{:.0f} rpm", "head speed: {head_speed:.2f} {speed}"),
    ("carry", "Carry", "{:.1f} m", "{yards:.0f} yd; apex {apex:.1f} m"),
)

#: Units of the published numbers that need one; speeds have that which the user chose.
_PRINTED_UNITS = {
    "contact_time": "µs", "max_force": "N", "energy_efficiency": "%", "momentum_final": "N·s",
    "launch_angle": "°", "backspin": "rpm", "carry": "m",
}  # fmt: skip


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
        instance.start(**self.changed(values))
        closing = v["club_speed"] - v["ball_speed"]
        approach = v["gap"] / closing if closing > 0.0 else 0.0
        # Over within the step, unless it takes longer than 30 years.
        instance.step(0.0, min(1.0 + 20.0 * _half_period(v) + approach, 1e9))
        m = instance.read(self.facts["metrics"])
        if not all(map(math.isfinite, m.values())):
            raise ValueError("This impact leaves the range of double precision.")
        m["contact_displacement_over_diameter"] = m["contact_displacement"] / v["ball_diameter"]
        m["compression_over_diameter"] = m["max_compression"] / v["ball_diameter"]
        m["momentum_initial"] = v["m_club"] * v["club_speed"] + v["m_ball"] * v["ball_speed"]
        m["momentum_final"] = m["momentum"]
        club, ball = (_energy(v[f"m_{body}"], v[f"{body}_speed"]) for body in ("club", "ball"))
        m["kinetic_energy_initial"] = initial = club + ball
        m["kinetic_energy_final"] = m["kinetic_energy"]
        for body in ("club", "ball"):
            left = _energy(v[f"m_{body}"], m[f"{body}_velocity"])
            m[f"{body}_share"] = _ratio(left, initial)
        m["momentum_kept"] = _ratio(m["momentum_final"], m["momentum_initial"])
        return m

    def changed(self, values: Mapping[str, float]) -> dict[str, float]:
        """Those values of ClubBallImpact that aren't its start values."""
        return {
            name: value
            for name, value in values.items()
            if value != self.defaults[name] and name not in LOFT
        }

    def impact(self, values: dict[str, float], unit: str) -> dict[str, Any]:
        """Everything that is shown of a case; speeds as text and as `…_shown` are in the unit."""
        metrics = self.metrics(values)
        touched, separated = map(self.instance.read_flag, ("touched", "separated"))
        path = self._path(values, metrics, touched, separated)
        size = self.facts["speeds"][unit]
        # Without separation there are maxima only, without contact nothing.
        valid = metrics if separated else {name: metrics[name] for name in MAXIMA if touched}
        for body in ("club", "ball"):
            path[f"{body}_shown"] = [speed / size for speed in path[f"{body}_velocity"]]
        shot, flight, problem = self.shot(values, metrics) if separated else ({}, {}, "")
        example: Mapping[str, Any] = {}
        for known in (*self.facts["examples"], *self.facts["clubs"]):
            if values == {**self.defaults, **known["values"]}:
                example = known
        # Without a parameter the page opens, and `golf-impact run` runs, something else.
        given = self.changed(values) or {"law": 1}
        loft = {name: values[name] for name in LOFT if values[name] != self.defaults[name]}
        texts = {n: repr(value).removesuffix(".0") for n, value in (given | loft).items()}
        return {
            "values": values,
            "query": urlencode(texts),
            "path": path,
            "metrics": metrics | shot,
            "flight": flight,
            "example": example.get("name", ""),
            # `run` has no loft.
            "command": "golf-impact run"
            + "".join(f" --set {name}={texts[name]}" for name in given),
            "ranges": _ranges(path, metrics, values, shot),
            "readouts": _readouts(valid, example, unit, size, READOUTS)
            + _readouts(shot, example, unit, size, SHOT_READOUTS),
            "hint": example.get("hint", ""),
            "peak": f"{metrics['max_force']:.0f} N" if touched else "",
            "area": _area(metrics, values, touched),
            "state": _state(touched, separated) or problem,
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
            return {}, {}, f"No flight: {error}"
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
        worst, count = 0.0, 0
        for example in self.facts["examples"]:
            metrics = self({"values": example["values"]})["metrics"]
            for name, expected in example["check"].items():
                error = abs(metrics[name] - expected)
                worst = max(worst, error / abs(expected) if expected else error)
                count += 1
        return {"count": count, "worst": worst}

    def _path(
        self, values: dict[str, float], metrics: dict[str, float], touched: bool, separated: bool
    ) -> dict[str, list[float]]:
        contact = metrics["contact_time"] if separated else _half_period(values)
        if touched and not separated:
            contact *= 10.0  # the time in which the contact develops
        end = nice(1.15 * contact)
        times = _times(contact, end, metrics["time_of_max_force"])
        # The approach is shown too, for any gap of the case.
        lead = -times[0]
        if touched:
            gap = (values["club_speed"] - values["ball_speed"]) * lead
            values = {**values, "gap": gap}
        host = [0.0, *(time + lead for time in times[1:])]
        steps = [after - before for before, after in pairwise(host)]
        if host[-1] + lead == host[-1] or min(steps) <= 0.0:
            raise ValueError(f"A contact of {contact:g} s is too short or too long to be drawn.")
        instance = self.instance
        instance.start(**self.changed(values))
        names = self.facts["path"]
        rows = [instance.read(names)]
        for point, step in zip(host, steps):
            instance.step(point, step)
            rows.append(instance.read(names))
        path = {name: [row[name] for row in rows] for name in names}
        touch = instance.read(("touch_time",))["touch_time"] if touched else 0.0
        for body in ("club", "ball"):
            moved = values["ball_speed"] * touch
            path[f"{body}_position"] = [x - moved for x in path[f"{body}_position"]]
        time = [instant - touch for instant in host]
        return {"time": time, **path, **_energies(values, path), **_shapes(values, path)}


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
    """Instants since touch: before it, closer at both ends of contact, its peak, after it; s."""
    before, within, after = POINTS
    close = 1e-6 * contact
    times = [-0.1 * end + n / (before - 1) * (0.1 * end - close) for n in range(before)]
    for n in range(within):
        share = n / (within - 1)
        times.append(contact * (0.5 * share + 0.25 * (1.0 - math.cos(math.pi * share))))
    times[before] = close
    times += [contact + n / (after - 1) * (end - contact) for n in range(1, after)]
    if 0.0 < peak < contact:
        nearest = min(range(before + 1, before + within - 1), key=lambda n: abs(times[n] - peak))
        times[nearest] = peak
    return times


def _energies(
    values: Mapping[str, float], path: Mapping[str, list[float]]
) -> dict[str, list[float]]:
    """Where the energy is, J: the spring's is ∫ k d_r (d/d_r)^n dd."""
    n, length = values["exponent"], values["reference_compression"]
    club, ball = (
        [_energy(values[f"m_{body}"], speed) for speed in path[f"{body}_velocity"]]
        for body in ("club", "ball")
    )
    full = values["k"] * length * length / (n + 1.0)
    spring = [full * (d / length) ** (n + 1.0) for d in path["compression"]]
    lost = [club[0] + ball[0] - sum(parts) for parts in zip(club, ball, spring)]
    return {"club_energy": club, "ball_energy": ball, "spring_energy": spring, "lost_energy": lost}


def _shapes(values: Mapping[str, float], path: Mapping[str, list[float]]) -> dict[str, list[float]]:
    """The ball, an ellipse that keeps its volume when it is compressed, and the club; m."""
    diameter = values["ball_diameter"]
    width = [max(diameter - d, 0.02 * diameter) for d in path["compression"]]
    return {
        "club_height": [1.2 * diameter] * len(width),
        "club_back": [x - 0.72 * diameter for x in path["club_position"]],
        "ball_middle": [x + diameter - 0.5 * w for x, w in zip(path["ball_position"], width)],
        "ball_width": width,
        "ball_height": [diameter * math.sqrt(diameter / w) for w in width],
    }


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
        "altitude": [0.0, nice(1.2 * shot.get("apex", 0.0))],
        "width": [-1.96 * height, 5.04 * height],
        "height": [-0.5 * height, 0.5 * height],
    }


def _readouts(
    metrics: Mapping[str, float],
    example: Mapping[str, Any],
    unit: str,
    size: float,
    table: Sequence[tuple[str, str, str, str]],
) -> list[dict[str, str]]:
    """Each metric as text, with what is published of the example that the case may be."""
    speeds = ("ball_velocity", "club_velocity", "ball_speed", "head_speed")
    scales = {**dict.fromkeys(speeds, 1.0 / size), "max_compression": 1e3}
    scales |= {"contact_time": 1e6, "time_of_max_force": 1e6}
    scales |= {"launch_angle": 1.0 / _DEGREE, "backspin": 30.0 / math.pi}
    m = {name: value * scales.get(name, 1.0) for name, value in metrics.items()}
    words: dict[str, Any] = {**m, "yards": metrics.get("carry", 0.0) / 0.9144, "speed": unit}
    rows = []
    for metric, label, form, meaning in table:
        if metric not in m:
            row = {"metric": metric, "label": label, "meaning": "", "value": "–"}
            rows.append({**row, "printed": ""})
            continue
        printed = ""
        if text := example.get("printed", {}).get(metric, ""):
            shown_in = _PRINTED_UNITS.get(metric, "")
            if metric.endswith("_velocity"):
                shown_in = unit
                if size != 1.0:
                    decimals = len(text.partition(".")[2])
                    text = f"{float(text) / size:.{decimals}f}"
            printed = f"{example['source']}: {text} {shown_in}".strip()
        row = {"metric": metric, "label": label, "meaning": meaning.format_map(words)}
        rows.append({**row, "value": form.format(m[metric], **words), "printed": printed})
    return rows


def _area(metrics: Mapping[str, float], values: Mapping[str, float], touched: bool) -> str:
    lost = max(metrics["kinetic_energy_initial"] - metrics["kinetic_energy_final"], 0.0)
    if not touched:
        return "no contact"
    if values["law"] == 1:
        return f"no loop: F = k d.\nThe drag takes {lost:.2f} J"
    if values["law"] == 2:
        return f"loop area: {lost:.2f} J,\nthe energy lost"
    # Another law, of which only the results are known.
    return f"{lost:.2f} J of kinetic energy lost"


def _state(touched: bool, separated: bool) -> str:
    """A sentence if there is no contact or no separation, else ""."""
    if not touched:
        return "No contact: the club never reaches the ball. It must be faster than the ball."
    if not separated:
        return "No separation: the bodies stay in contact (under law 1 a valid result of its drag)."
    return ""
