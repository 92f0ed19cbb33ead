"""One impact's metrics: ours against the ways to get them without this FMU, or with it otherwise.

One impact is a run begun anew by restoring the saved start, a new k, one step and one read of S,
COR and E. k changes at every impact, so that nothing can come from a cache of the last one.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle, islice
from statistics import median

import fmpy

from golf_impact.benchmarks.floor import walk
from golf_impact.facts.document import TIME_STEP
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.peers import solve_ivp
from golf_impact.peers.document_scheme import steps_of_contact
from golf_impact.peers.problem import Case, Outcome
from golf_impact.timing import Job, interleaved, median_ratio, seconds

#: S, COR and E: what a metrics-only scene reads.
METRICS = ("smash_factor", "coefficient_of_restitution", "energy_efficiency")

#: Around the baseline's stiffness, N/m: neighbours differ by a few percent.
STIFFNESSES = tuple(1e6 * (0.9 + 0.2 * (37 * n % 101) / 101) for n in range(101))

#: Longer than any of these contacts, s.
STEP = 1e-3

#: From k (N/m) to outputs.
Impact = Callable[[float], list[float]]


def speedups(
    ours: LoadedFmu, document: LoadedFmu, rounds: int, tick: Callable[[], None]
) -> dict[str, float]:
    """Speed-ups by key, and each way's time per impact in µs (`…_us`), for both laws."""
    figures: dict[str, float] = {}
    for law, suffix in ((2, ""), (1, "_law1")):
        # Of its own folder: it isn't to profit from a library that another one has loaded.
        with LoadedFmu(ours.path) as alone:
            # So many of ours per round that the first ones, after another job has had the
            # processor's caches, don't count; the other ways are far slower, and take fewer.
            document_way = document_impact(document, law, METRICS, TIME_STEP, STIFFNESSES)
            jobs = {
                "fmu": _job(impact_of_stiffness(ours, METRICS, law=law), 200),
                "document_fmu": _job(document_way, 1),
                "simulate_fmu": _job(_simulation(alone, law), 2),
                "scipy": _job(partial(_scipy_impact, law), 2),
            }
            times = interleaved(jobs, rounds, tick)
        for name, spent in times.items():
            figures[f"impact_by_{name}{suffix}_us"] = 1e6 * median(spent)
            if name != "fmu":
                key = f"impact_speedup_over_{name}{suffix}"
                figures[key] = median_ratio(spent, times["fmu"])
    return figures


def _job(impact: Callable[[float], object], number: int) -> Job:
    """So many impacts, each with another stiffness."""
    values = cycle(STIFFNESSES)

    def impacts() -> None:
        for value in islice(values, number):
            impact(value)

    return partial(seconds, impacts, number)


def impact_of_stiffness(
    fmu: LoadedFmu, outputs: Sequence[str], step: float = STEP, **values: float
) -> Impact:
    """An impact as a scene makes it, of an instance with these values, in one step (s)."""
    slave = fmu.instance(**values)
    start, k, read = slave.getFMUstate(), fmu.references(("k",)), fmu.references(outputs)

    def impact(value: float) -> list[float]:
        slave.setFMUstate(start)
        slave.setReal(k, [value])
        slave.doStep(0.0, step)
        return slave.getReal(read)

    return impact


def document_impact(
    fmu: LoadedFmu, law: int, outputs: Sequence[str], dt: float, stiffnesses: Sequence[float]
) -> Impact:
    """The document's scheme by steps of dt (s) to the end of contact, and no further.

    How many steps that takes is known beforehand, for these stiffnesses.
    """
    slave = fmu.instance(law=law, dt=dt)
    start, k, read = slave.getFMUstate(), fmu.references(("k",)), fmu.references(outputs)

    def begin(value: float) -> None:
        slave.setFMUstate(start)
        slave.setReal(k, [value])

    points = {}
    for value in stiffnesses:
        begin(value)
        points[value] = [n * dt for n in range(steps_of_contact(fmu, slave, dt, end=0.01))]

    def impact(value: float) -> list[float]:
        begin(value)
        walk(slave, points[value], dt)
        return slave.getReal(read)

    return impact


def _simulation(fmu: LoadedFmu, law: int) -> Callable[[float], object]:
    """fmpy.simulate_fmu with one step: what it costs not to keep an instance.

    The FMU is extracted beforehand and its description read, and no other instance holds its
    library: so it is for whoever calls simulate_fmu in a loop.
    """
    return lambda value: fmpy.simulate_fmu(
        fmu.folder,
        stop_time=STEP,
        output_interval=STEP,
        start_values={"law": law, "k": value},
        output=METRICS,
        model_description=fmu.description,
    )


def _scipy_impact(law: int, value: float) -> Outcome:
    return solve_ivp.solve(Case(law=law, k=value), rtol=1e-12, method="DOP853")
