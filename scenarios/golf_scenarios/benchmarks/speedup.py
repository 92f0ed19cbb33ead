"""One impact's metrics: ours against the ways to get them without this FMU, or with it otherwise.

One impact is a run begun anew by restoring the saved start, a new k, one step and one read of S,
COR and E. k changes at every impact, so that nothing can come from a cache of the last one.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle
from time import perf_counter

import fmpy
from fmpy.fmi2 import FMU2Slave

from golf_scenarios.fmu.loaded import LoadedFmu
from golf_scenarios.peers import solve_ivp
from golf_scenarios.peers.problem import Case
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

#: The document's own time step, s.
DOCUMENT_STEP = 0.5e-6


def speedups(
    ours: LoadedFmu, document: LoadedFmu, rounds: int, tick: Callable[[], None]
) -> dict[str, float]:
    """Speed-ups by key, and each way's time per impact in µs (`…_us`), for both laws.

    Args:
        ours: ClubBallImpact.fmu.
        document: the document's scheme as an FMU.
        rounds: of which the medians are taken.
        tick: called after each round.
    """
    figures: dict[str, float] = {}
    for law, suffix in ((2, ""), (1, "_law1")):
        # Of its own folder: it isn't to profit from a library that another one has loaded.
        with LoadedFmu(ours.path) as alone:
            jobs: dict[str, Job] = {
                "fmu": _impacts(ours, law, _BATCH),
                "document_fmu": _document_impacts(document, law, 1),
                "simulate_fmu": _simulations(alone, law, _FEW),
                "scipy": _scipy_impacts(law, _FEW),
            }
            with undisturbed():
                times = interleaved(jobs, rounds, tick)
        for name, seconds in times.items():
            figures[f"impact_by_{name}{suffix}_us"] = 1e6 * sorted(seconds)[len(seconds) // 2]
            if name != "fmu":
                key = f"impact_speedup_over_{name}{suffix}"
                figures[key] = median_ratio(seconds, times["fmu"])
    return figures


def impact(slave: FMU2Slave, start: object, k: list[int], read: list[int], value: float):
    """One impact as a scene makes it; `start` is the saved state, k and read are references."""
    slave.setFMUstate(start)
    slave.setReal(k, [value])
    slave.doStep(0.0, STEP)
    return slave.getReal(read)


def _impacts(fmu: LoadedFmu, law: int, number: int) -> Job:
    slave = fmu.instance(law=law)
    start = slave.getFMUstate()
    k, read = fmu.references(("k",)), fmu.references(METRICS)
    values = cycle(STIFFNESSES)

    def job() -> float:
        begin = perf_counter()
        for _ in range(number):
            impact(slave, start, k, read, next(values))
        return (perf_counter() - begin) / number

    return job


def _document_impacts(fmu: LoadedFmu, law: int, number: int) -> Job:
    """To the end of contact, and no further; that number of steps is known beforehand."""
    slave = fmu.instance(law=law)
    start = slave.getFMUstate()
    k, read = fmu.references(("k",)), fmu.references(METRICS)
    ended, number_of_steps = fmu.references(("in_contact",)), {}
    for value in STIFFNESSES[:11]:
        slave.setFMUstate(start)
        slave.setReal(k, [value])
        n = 0
        while slave.getBoolean(ended)[0]:
            slave.doStep(n * DOCUMENT_STEP, DOCUMENT_STEP)
            n += 1
        number_of_steps[value] = n
    values = cycle(number_of_steps.items())

    def job() -> float:
        begin = perf_counter()
        for _ in range(number):
            value, steps = next(values)
            slave.setFMUstate(start)
            slave.setReal(k, [value])
            do_step = slave.doStep
            for n in range(steps):
                do_step(n * DOCUMENT_STEP, DOCUMENT_STEP)
            slave.getReal(read)
        return (perf_counter() - begin) / number

    return job


def _simulations(fmu: LoadedFmu, law: int, number: int) -> Job:
    """Time of fmpy.simulate_fmu with one step: what it costs not to keep an instance.

    The FMU is extracted beforehand and its description read, and no other instance holds its
    library: so it is for whoever calls simulate_fmu in a loop.
    """
    values = cycle(STIFFNESSES)

    def job() -> float:
        begin = perf_counter()
        for _ in range(number):
            fmpy.simulate_fmu(
                fmu.folder,
                stop_time=STEP,
                output_interval=STEP,
                start_values={"law": law, "k": next(values)},
                output=METRICS,
                model_description=fmu.description,
            )
        return (perf_counter() - begin) / number

    return job


def _scipy_impacts(law: int, number: int) -> Job:
    values = cycle(STIFFNESSES)

    def job() -> float:
        begin = perf_counter()
        for _ in range(number):
            solve_ivp.solve(Case(law=law, k=next(values)), rtol=1e-12, method="DOP853")
        return (perf_counter() - begin) / number

    return job
