"""What the page shows of a case, from its values: paths, ranges, labels, readouts, sweep, shot.

It needs the physics, units and the standard library only: it runs in an exported page, too.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from golf_physics.companions.ball_flight import BallFlight
from golf_physics.companions.companion import Variable
from golf_physics.companions.launch import Launch
from golf_physics.instance import Instance, RefusedError

from golf_impact.units import remarks, si_values, unit_of

Values = Mapping[str, float]
Columns = dict[str, list[float]]
Facts = Mapping[str, Any]

#: Results of an impact without separation.
MAXIMA = ("max_force", "time_of_max_force", "max_compression", "compression_over_diameter")

NO_CONTACT = "No contact: the club never reaches the ball. It must be faster than the ball."
NO_SEPARATION = "No separation: the bodies stay in contact (a valid result of law 1's drag)."

#: The label of the loop by law; of other laws only the results are known.
AREAS = {
    1.0: "no loop: F = k d; the drag takes {:.2f} J",
    2.0: "loop area: {:.2f} J, the energy lost",
}

#: Metrics that are shown in the unit that the user chose.
SPEEDS = ("ball_velocity", "club_velocity", "ball_speed", "head_speed")

#: Of the path, kg.m/s.
MOMENTA = ("club_momentum", "ball_momentum", "total_momentum")

#: Communication points before touch, in contact, after it.
POINTS = (8, 100, 16)

#: Results that are plotted over one variable, and the number of its values.
SWEPT_METRICS = ("smash_factor", "coefficient_of_restitution")
SWEPT = 25

#: Parameters of Launch alone, others of it, and its inputs from the impact.
LOFT = ("dynamic_loft", "attack_angle", "friction")
BODIES = ("m_club", "m_ball", "ball_diameter")
FROM_IMPACT = ("ball_velocity", "club_velocity", "smash_factor", "coefficient_of_restitution")

#: Of the shot: outputs of Launch and BallFlight; the flight that is drawn.
LAUNCH = ("ball_speed", "launch_angle", "backspin")
FLIGHT = ("carry", "apex", "flight_time")
FLIGHT_POINTS = 30
NO_FLIGHT: Columns = {"distance": [], "height": []}


#: What is raised where values can't be used; a RefusedError is a ValueError.
_REFUSED = (ValueError, OverflowError)


def in_process(*tables: Sequence[tuple]) -> list[Instance]:
    """ClubBallImpact, Launch and BallFlight in this process, from the variables of the latter."""
    instances = [Instance()]
    for kind, rows in zip((Launch, BallFlight), tables):
        instances.append(Instance(partial(kind, rows), [Variable(*row) for row in rows]))
    return instances


def make_evaluator() -> Callable[[str], str]:
    """The evaluator of an exported page, from and to JSON; facts.json is beside this file."""
    rows, facts = json.loads(Path(__file__).with_name("facts.json").read_text())
    evaluator = Evaluator(in_process(*rows), facts)
    return lambda request: json.dumps(evaluator(json.loads(request)))


class Evaluator:
    """Computes what the page shows, from its requests.

    Args:
        instances: of ClubBallImpact, Launch and BallFlight: those of `in_process`, or `LoadedFmu`.
        facts: start values (`defaults`), outputs that are read (`metrics`, `path`), `speeds` by
            unit in m/s, presets, and the other tables of cases.toml; for `check`, `expected`:
            the metrics of each example.
    """

    def __init__(self, instances: Sequence[Any], facts: Facts) -> None:
        self.instance, self.launch, self.flight = instances
        self.facts = facts
        self.defaults: dict[str, float] = facts["defaults"]

    def __call__(self, request: Facts) -> dict[str, Any]:
        """Evaluate a request.

        Args:
            request: `values`, inputs and parameters by name (SI; start values for the others),
                numbers, texts that may have a unit, or of a field its `text` and the `unit` of
                a number without one; `unit` of speeds; `shot`, False without launch and flight
                (more than half of the time). Instead of the impact: `over`, the variable over
                which S and COR are computed; `check`.

        Returns:
            A dictionary for JSON; `refused`, a sentence, and `about`, the variable concerned, where
            the values can't be used, `unread` if that is a text that is no value; `remarks` by
            name on texts that may lack another unit.
        """
        if "check" in request:
            return self.check()
        try:
            values = self._values(given := request.get("values", {}))
            if "over" in request:
                return self.sweep(values, request["over"])
            shown = self.impact(values, request.get("unit", "m/s"), request.get("shot", True))
            return shown | {"remarks": _remarks(given, values)}
        except _REFUSED as error:
            about, value = getattr(error, "variable", ""), getattr(error, "value", None)
            about = about if about in self.defaults else ""
            return {"refused": str(error), "about": about, "unread": isinstance(value, str)}

    def _values(self, changes: Facts) -> dict[str, float]:
        values = dict(self.defaults)
        for name, given in changes.items():
            if name not in values:
                known = ", ".join(values)
                raise ValueError(f"There is no input or parameter {name}: choose from {known}.")
            if isinstance(given, float | int):
                values[name] = float(given)
                continue
            text, unit = (given["text"], given["unit"]) if isinstance(given, dict) else (given, "")
            text = str(text)
            try:
                values[name], _ = si_values([text, f"1 {unit}"], unit_of(name))
            except ValueError as error:
                sentence = f"{name}={text} is refused: {error}"
                raise RefusedError(sentence, name, text, str(error)) from None
        return values

    def metrics(self, values: Values) -> dict[str, float]:
        """Metrics of an impact, in one communication step, by the names of results.json."""
        instance, v = self.instance, values
        instance.start(**_without_loft(values))
        # Over within the step, unless it takes longer than 30 years.
        instance.step(0.0, 1e9)
        if v["club_force"] and instance.read_flag("separated"):
            # At separation: the head goes on accelerating.
            end = sum(instance.read(("touch_time", "contact_time")).values())
            instance.start(**_without_loft(values))
            instance.step(0.0, end * (1.0 + 2.0**-51))
        m = instance.read([*self.facts["metrics"], "club_position"])
        moved = m.pop("club_position") - v["ball_speed"] * m["touch_time"]
        m["work_on_club"] = v["club_force"] * moved if v["club_force"] else 0.0
        if not all(map(math.isfinite, m.values())):
            raise ValueError("This impact leaves the range of double precision.")
        diameter = v["ball_diameter"]
        m["contact_displacement_over_diameter"] = m["contact_displacement"] / diameter
        m["compression_over_diameter"] = m["max_compression"] / diameter
        before = v["m_club"] * v["club_speed"] + v["m_ball"] * v["ball_speed"]
        m["momentum_initial"], m["momentum_final"] = before, m["momentum"]
        m["momentum_kept"] = m["momentum"] / before if before else 0.0
        initial = sum(_energy(v[f"m_{body}"], v[f"{body}_speed"]) for body in ("club", "ball"))
        m["kinetic_energy_initial"], m["kinetic_energy_final"] = initial, m["kinetic_energy"]
        for body in ("club", "ball"):
            left = _energy(v[f"m_{body}"], m[f"{body}_velocity"])
            m[f"{body}_share"] = left / (initial or 1.0)
        return m

    def impact(self, values: dict[str, float], unit: str, shot: bool) -> dict[str, Any]:
        """Everything that is shown of a case; speeds as text and as `…_shown` are in the unit."""
        metrics = self.metrics(values)
        touched, separated = map(self.instance.read_flag, ("touched", "separated"))
        size = self.facts["speeds"][unit]
        path = self._path(values, metrics, touched, separated)
        for body in ("club", "ball"):
            path[f"{body}_shown"] = [speed / size for speed in path[f"{body}_velocity"]]
        # Without separation there are maxima only, without contact nothing.
        valid = metrics if separated else {name: metrics[name] for name in MAXIMA if touched}
        launched = separated and shot
        shots, flight, problem = self.shot(values, metrics) if launched else ({}, NO_FLIGHT, "")
        ball, club = self._preset("balls", values), self._preset("clubs", values)
        case = club or self._preset("examples", values)
        hint = case.get("hint", "") + (self._other_than_fitted(values, ball) if club else "")
        changed = {name: x for name, x in values.items() if x != self.defaults[name]}
        texts = {name: repr(x).removesuffix(".0") for name, x in changed.items()}
        area = AREAS.get(values["law"], "{:.2f} J of kinetic energy lost")
        initial = metrics["kinetic_energy_initial"]
        lost = initial + metrics["work_on_club"] - metrics["kinetic_energy_final"]
        # Without a parameter the page opens, and `golf-impact run` runs, something else.
        given = _without_loft(texts) or {"law": "1"}
        query, of_preset = given | texts, {*ball.get("values", {}), *club.get("values", {})}
        own = [f"{name} = {text}" for name, text in query.items() if name not in of_preset]
        return {
            "values": values,
            "query": urlencode(query),
            "path": path,
            "metrics": metrics | shots,
            "flight": flight,
            "ranges": _ranges(path, flight, metrics["kinetic_energy_initial"]),
            "readouts": self._readouts(valid | shots, case, unit),
            "peak": f"{metrics['max_force']:.0f} N" if touched else "",
            "area": area.format(max(lost, 0.0)) if touched else "no contact",
            # `run` has no loft: such a case has a link alone.
            "command": ""
            if changed.keys() & {*LOFT}
            else " --set ".join(["golf-impact run", *map("=".join, given.items())]),
            "equations": self._equations(values, metrics, separated),
            "ball": ball.get("name", ""),
            "club": club.get("name", ""),
            "title": ", ".join(filter(None, [club.get("name"), ball.get("name"), *own])),
            "source": ball.get("source", ""),
            "hint": hint,
            "state": problem if separated else NO_SEPARATION if touched else NO_CONTACT,
        }

    def _preset(self, kind: str, values: Values) -> Facts:
        """The preset with these values, or nothing."""
        same = (one for one in self.facts[kind] if one["values"].items() <= values.items())
        return next(same, {})

    def _other_than_fitted(self, values: Values, ball: Facts) -> str:
        """What else differs from the case with which a club's loft is fitted, as a sentence."""
        fitted, of_club = self.facts["fitted"], self.facts["clubs"][0]["values"]
        others = [n for n, x in values.items() if n not in of_club and x != fitted["values"][n]]
        if ball and ball["name"] != fitted["name"]:
            others = [n for n in others if n not in ball["values"]]
            others.insert(0, f"ball {ball['name']} instead of {fitted['name']}")
        return f" Other than in the fit: {', '.join(others)}." if others else ""

    def _equations(self, values: Values, metrics: Values, separated: bool) -> list[str]:
        kinds = {
            "": True,
            " linear": values["exponent"] == 1.0,
            " power": values["exponent"] != 1.0,
            " COR": values["restitution_at_rest"] != 0.0,
            " separated": separated,
        }
        v = values
        approach, ratio = v["club_speed"] - v["ball_speed"], v["m_ball"] / v["m_club"]
        own = {"stiffness": v["k"] / 1e3, "approach": approach, "ratio": ratio}
        numbers = {**v, **metrics, **own}
        names = [f"{values['law']:g}{kind}" for kind, is_so in kinds.items() if is_so]
        lines = (line for name in names for line in self.facts["equations"].get(name, ()))
        return [line.format(**numbers) for line in lines]

    def shot(self, values: Values, metrics: Values) -> tuple[dict[str, float], Columns, str]:
        """Launch and flight: metrics, curve (m), and why there is none."""
        v, path = {**values, **metrics}, {name: [0.0] for name in NO_FLIGHT}
        try:
            given = {name: v[name] for name in (*LOFT, *BODIES, *FROM_IMPACT)}
            self.launch.start(**given, separated=True)
            self.launch.step(0.0, 1e-3)
            shot = self.launch.read(LAUNCH)
            given = {name: v[name] for name in BODIES[1:]} | {"ball_velocity": shot["ball_speed"]}
            self.flight.start(**given, **{name: shot[name] for name in LAUNCH[1:]}, separated=True)
            self.flight.step(0.0, time := 1e-6)
            shot |= self.flight.read(FLIGHT)
            for n in range(1, FLIGHT_POINTS + 1 if shot["flight_time"] > 1e-3 else 1):
                end = shot["flight_time"] * n / FLIGHT_POINTS
                self.flight.step(time, end - time)
                time = end
                for name, value in self.flight.read([*NO_FLIGHT]).items():
                    path[name].append(value)
        except _REFUSED as error:
            return {}, NO_FLIGHT, f"No flight: {error}"
        shot["head_speed"] = v["club_speed"] / math.cos(v["dynamic_loft"] - v["attack_angle"])
        return shot, path, ""

    def sweep(self, values: Values, over: str) -> dict[str, Any]:
        """S and COR over one variable, where it is accepted and the bodies separate."""
        ranges = {q["name"]: q for q in self.facts["quantities"] if "step" in q}
        if (q := ranges.get(str(over))) is None:
            raise ValueError(f"There is no slider {over!r}: choose from {', '.join(ranges)}.")
        swept: Columns = {name: [] for name in ("x", *SWEPT_METRICS)}
        for n in range(SWEPT):
            x = (q["low"] + n / (SWEPT - 1) * (q["high"] - q["low"])) * q["scale"]
            with suppress(*_REFUSED):
                metrics = {"x": x, **self.metrics({**values, over: x})}
                if self.instance.read_flag("separated"):
                    for name, column in swept.items():
                        column.append(metrics[name])
        return {"over": over, "swept": swept}

    def example_metrics(self) -> list[dict[str, float]]:
        """The metrics of each example."""
        return [self({"values": one["values"]})["metrics"] for one in self.facts["examples"]]

    def check(self) -> dict[str, Any]:
        """How far the metrics of the examples are from those expected."""
        errors = []
        for metrics, expected in zip(self.example_metrics(), self.facts["expected"]):
            for name, value in expected.items():
                errors.append(abs(metrics[name] - value) / (abs(value) or 1.0))
        return {"count": len(errors), "worst": max(errors)}

    def _readouts(self, metrics: Values, case: Facts, unit: str) -> list[dict[str, str]]:
        """Each metric as text, with what is published of a preset."""
        size = self.facts["speeds"][unit]
        factors = {**self.facts["factors"], **dict.fromkeys(SPEEDS, 1.0 / size)}
        shown = {name: value * factors.get(name, 1.0) for name, value in metrics.items()}
        words = {**shown, "speed": unit, "yards": metrics.get("carry", 0.0) / self.facts["yard"]}
        rows = []
        for metric, label, decimals, suffix, meaning in self.facts["readouts"]:
            row = {"metric": metric, "label": label, "meaning": "", "value": "–", "printed": ""}
            rows.append(row)
            if metric in shown:
                suffix = suffix.format(**words)
                row["meaning"] = meaning.format(**words)
                row["value"] = f"{shown[metric]:.{decimals}f}{suffix}"
                if text := case.get("printed", {}).get(metric):
                    if metric in SPEEDS:
                        text = f"{float(text) / size:.{len(text.partition('.')[2])}f}"
                    row["printed"] = f"{case['source']}: {text}{suffix}"
        return rows

    def _path(self, values: Values, metrics: Values, touched: bool, separated: bool) -> Columns:
        contact = metrics["contact_time"]
        if not separated:
            # The time in which a contact without damping ends, π √(μ/k), or this one develops.
            mu = 1.0 / (1.0 / values["m_club"] + 1.0 / values["m_ball"])
            contact = (10.0 if touched else 1.0) * math.pi * math.sqrt(mu / values["k"])
        end = nice(1.15 * contact)
        # The approach is shown too, for any gap of the case.
        lead = 0.1 * end
        if touched:
            values = {**values, "gap": (values["club_speed"] - values["ball_speed"]) * lead}
        points = _points(lead, contact, end, metrics["time_of_max_force"])
        if len(points) < sum(POINTS) or points[-1] + lead == points[-1]:
            raise ValueError(f"A contact of {contact:g} s is too short or too long to be drawn.")
        self.instance.start(**_without_loft(values))
        rows, before = [], 0.0
        for point in points:
            if point:
                self.instance.step(before, point - before)
            before = point
            row = {"time": point - lead, **self.instance.read(self.facts["path"])}
            rows.append(_complete(row, values, values["ball_speed"] * lead))
        return {name: [row[name] for row in rows] for name in rows[0]}


def _remarks(given: Facts, values: Values) -> dict[str, str]:
    """What the command line remarks on numbers that are written in SI units, by name."""
    found = {}
    for name, text in given.items():
        text = text["text"] if isinstance(text, dict) else text
        # Not with a unit.
        with suppress(ValueError):
            if isinstance(text, str) and float(text) == values[name]:
                found[name] = " ".join(remarks({name: values[name]}, "{}="))
    return found


def _complete(row: dict[str, float], v: Values, moved: float) -> dict[str, float]:
    """Add to one instant of the path: energies (J), and the scene (in ball diameters).

    The spring's energy is ∫ k d_r (d/d_r)^n dd. The ball is an ellipse that keeps its volume when
    it is compressed. Positions are those since touch, until which the ball has `moved`.
    """
    lost = 0.0
    for body in ("club", "ball"):
        row[f"{body}_energy"] = _energy(v[f"m_{body}"], row[f"{body}_velocity"])
        lost += _energy(v[f"m_{body}"], v[f"{body}_speed"]) - row[f"{body}_energy"]
        row[f"{body}_position"] -= moved
        row[f"{body}_momentum"] = v[f"m_{body}"] * row[f"{body}_velocity"]
    row["total_momentum"] = row["club_momentum"] + row["ball_momentum"]
    if v["club_force"] and row["time"] > 0.0:
        lost += v["club_force"] * row["club_position"]
    n, length, diameter = v["exponent"], v["reference_compression"], v["ball_diameter"]
    spring = v["k"] * length**2 / (n + 1.0) * (row["compression"] / length) ** (n + 1.0)
    width = max(1.0 - row["compression"] / diameter, 0.02)
    scene = {
        "club_face": row["club_position"] / diameter,
        "club_back": row["club_position"] / diameter - 0.72,
        "ball_middle": row["ball_position"] / diameter + 1.0 - 0.5 * width,
        "ball_width": width,
        "ball_height": 1.0 / math.sqrt(width),
    }
    return {**row, "spring_energy": spring, "lost_energy": lost - spring, **scene}


def _without_loft(values: Facts) -> dict[str, Any]:
    """Those of ClubBallImpact."""
    return {name: value for name, value in values.items() if name not in LOFT}


def _energy(mass: float, speed: float) -> float:
    return 0.5 * mass * speed * speed


def nice(limit: float) -> float:
    """The next of 1, 1.5, 2, 2.5, 3 … times a power of ten: the end of an axis."""
    if not 1e-300 < limit < math.inf:
        return 1.0
    unit = 0.5 * 10.0 ** math.floor(math.log10(limit))
    return math.ceil(limit / unit) * unit


def _points(lead: float, contact: float, end: float, peak: float) -> list[float]:
    """Communication points, s: equally spaced before and after contact, closer at both its ends."""
    before, within, after = POINTS
    shares = [0.5 * (1.0 - math.cos(math.pi * n / within)) for n in range(1, within + 1)]
    points = [n / before * lead for n in range(before)]
    points += [lead + share * contact for share in (-1e-6, 1e-6, *shares)]
    points += [lead + contact + n / after * (end - contact) for n in range(1, after + 1)]
    return sorted({*points, lead + peak})


def _ranges(path: Columns, flight: Columns, energy: float) -> Columns:
    """Axis limits by quantity: those of the plotted columns, with a margin."""
    columns = {
        # Above the data there is room for a line of text.
        "force": (1.25, path["force"]),
        "compression": (1.05, path["compression"]),
        "energy": (1.25, [energy]),
        "momentum": (1.25, [x for name in MOMENTA for x in path[name]]),
        "velocity": (1.25, path["club_shown"] + path["ball_shown"]),
        "position": (1.25, path["club_position"] + path["ball_position"]),
        "distance": (1.02, flight["distance"]),
        "height": (1.2, flight["height"]),
    }
    ranges = {"time": [-0.1 * path["time"][-1], path["time"][-1]]}
    for name, (margin, column) in columns.items():
        low, high = min(column, default=0.0), max(column, default=0.0)
        ranges[name] = [-nice(-margin * low) if low < 0.0 else 0.0, nice(margin * high)]
    return ranges
