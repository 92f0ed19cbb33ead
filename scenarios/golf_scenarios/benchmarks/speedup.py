"""One impact's metrics: ours against the ways to get them without this FMU, or with it otherwise.

One impact is a run begun anew by restoring the saved start, a new k, one step and one read of S,
COR and E. k changes at every impact, so that nothing can come from a cache of the last one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle
from statistics import median
from time import perf_counter

import fmpy

from golf_scenarios.facts.document import TIME_STEP
from golf_scenarios.fmu.loaded import LoadedFmu
from golf_scenarios.peers import solve_ivp
from golf_scenarios.peers.document_scheme import steps_of_contact
from golf_scenarios.peers.problem import Case, Outcome
from golf_scenarios.timing import Job, interleaved, median_ratio, undisturbed

#: S, COR and E: what a metrics-only scene reads.
METRICS = ("smash_factor", "coefficient_of_restitution", "energy_efficiency")

#: Around the baseline's stiffness, N/m: neighbours differ by a few percent.
STIFFNESSES = tuple(1e6 * (0.9 + 0.2 * (37 * n % 101) / 101) for n in range(101))

#: Longer than any of these contacts, s.
STEP = 1e-3

#: Impacts per round: enough that the first ones, after another job has had the processor's caches,
#: don't count; the other ways are far slower, and take fewer.
_BATCH, _FEW = 200, 2


def speedups(
    ours: LoadedFmu, document: LoadedFmu, rounds: int, tick: Callable[[], None]
) -> dict[str, float]:
    """Speed-ups by key, and each way's time per impact in µs (`…_us`), for both laws."""
    figures: dict[str, float] = {}
    for law, suffix in ((2, ""), (1, "_law1")):
        # Of its own folder: it isn't to profit from a library that another one has loaded.
        with LoadedFmu(ours.path) as alone:
            jobs = {
                "fmu": _job(impact_of_stiffness(ours, law, METRICS), _BATCH),
                "document_fmu": _job(_document_impact(document, law), 1),
                "simulate_fmu": _job(_simulation(alone, law), _FEW),
                "scipy": _job(partial(_scipy_impact, law), _FEW),
            }
            with undisturbed():
                times = interleaved(jobs, rounds, tick)
        for name, seconds in times.items():
            figures[f"impact_by_{name}{suffix}_us"] = 1e6 * median(seconds)
            if name != "fmu":
                key = f"impact_speedup_over_{name}{suffix}"
                figures[key] = median_ratio(seconds, times["fmu"])
    return figures


def _job(impact: Callable[[float], object], number: int) -> Job:
    """So many impacts, each with another stiffness."""
    values = cycle(STIFFNESSES)

    def job() -> float:
        begin = perf_counter()
        for _ in range(number):
            impact(next(values))
        return (perf_counter() - begin) / number

    return job


def impact_of_stiffness(
    fmu: LoadedFmu, law: int, outputs: Sequence[str]
) -> Callable[[float], list[float]]:
    """From k (N/m) to outputs, as a scene makes an impact."""
    slave = fmu.instance(law=law)
    start = slave.getFMUstate()
    k, read = fmu.references(("k",)), fmu.references(outputs)

    def impact(value: float) -> list[float]:
        slave.setFMUstate(start)
        slave.setReal(k, [value])
        slave.doStep(0.0, STEP)
        return slave.getReal(read)

    return impact


def _document_impact(fmu: LoadedFmu, law: int) -> Callable[[float], object]:
    """To the end of contact, and no further; that number of steps is known beforehand."""
    slave = fmu.instance(law=law)
    start = slave.getFMUstate()
    k, read = fmu.references(("k",)), fmu.references(METRICS)
    number_of_steps = {}
    for value in STIFFNESSES:
        slave.setFMUstate(start)
        slave.setReal(k, [value])
        number_of_steps[value] = steps_of_contact(fmu, slave, TIME_STEP)

    def impact(value: float) -> list[float]:
        slave.setFMUstate(start)
        slave.setReal(k, [value])
        do_step = slave.doStep
        for n in range(number_of_steps[value]):
            do_step(n * TIME_STEP, TIME_STEP)
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
