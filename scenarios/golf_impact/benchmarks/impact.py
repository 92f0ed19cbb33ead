"""Run time of an impact: S, COR and E by this FMU and by other methods.

One impact is a restored start state, a new k, one step and one read. k changes at every impact, so
that no result can come from a cache.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import cycle, islice
from statistics import median

from golf_impact.document import TIME_STEP
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.peers import solve_ivp
from golf_impact.peers.compiled import SUB_STEP
from golf_impact.peers.problem import Case, Outcome, errors
from golf_impact.reference import exact_outcome
from golf_impact.timing import Job, measure_seconds, median_ratio, run_interleaved

#: S, COR and E: what a metrics-only scene reads.
METRICS = ("smash_factor", "coefficient_of_restitution", "energy_efficiency")

#: Around the baseline's stiffness, N/m: neighbours differ by a few percent.
STIFFNESSES = tuple(1e6 * (0.9 + 0.2 * (37 * n % 101) / 101) for n in range(101))

#: Longer than any of these contacts, s.
STEP = 1e-3

#: From k (N/m) to outputs.
Impact = Callable[[float], Sequence[float]]


def impact_of(
    fmu: LoadedFmu,
    outputs: Sequence[str],
    step: float = STEP,
    points: Callable[[float], Iterable[float]] = lambda _: (0.0,),
    moving: Sequence[str] = (),
    begin: float = 0.0,
    **values: float,
) -> Impact:
    """An impact as a scene makes it: a restored state, a new k, steps, and a read of the outputs.

    It is made in an instance with these values by steps of size `step` from the `points` (s) for
    each k, after which `moving` outputs are read. The restored state is that at `begin`.
    """
    slave = fmu.instance(**values)
    if begin:
        slave.doStep(0.0, begin)
    start, k = slave.getFMUstate(), fmu.references(("k",))
    read, read_moving = fmu.references(outputs), fmu.references(moving)
    do_step, get_real = slave.doStep, slave.getReal

    def impact(value: float) -> list[float]:
        slave.setFMUstate(start)
        slave.setReal(k, [value])
        for point in points(value):
            do_step(point, step)
            if read_moving:
                get_real(read_moving)
        return get_real(read)

    return impact


def document_impact(
    fmu: LoadedFmu, law: int, stiffnesses: Sequence[float], dt: float, outputs: Sequence[str]
) -> Impact:
    """The document's scheme by steps of dt (s) to the end of contact, known for these k (N/m)."""
    contact_time = impact_of(fmu, ("contact_time",), law=law, dt=dt)
    numbers = {k: round(contact_time(k)[0] / dt) for k in stiffnesses}
    points = {k: [n * dt for n in range(number)] for k, number in numbers.items()}
    return impact_of(fmu, outputs, dt, points.__getitem__, law=law, dt=dt)


def repeated(impact: Impact, number: int) -> Job:
    """So many impacts, each with another stiffness."""
    values = cycle(STIFFNESSES)
    return partial(measure_seconds, lambda: [impact(k) for k in islice(values, number)], number)


def microseconds(times: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Medians of these times (s) in µs, as `…_us`."""
    return {f"{name}_us": 1e6 * median(spent) for name, spent in times.items()}


def other_ways(
    ours: LoadedFmu, document: LoadedFmu, compiled: Mapping[str, LoadedFmu], rounds: int
) -> dict[str, float]:
    """An impact by each way, under law 2 and law 1 (`…_law1`).

    By key: times in µs (`…_us`), worst errors, `impact_speedup_over_…` (another way's time over
    ours) and, for compiled FMUs, `impact_over_…` (ours over theirs).
    """
    figures: dict[str, float] = {}
    for law, suffix in ((2, ""), (1, "_law1")):
        case = Case(law=law)
        exact = exact_outcome(case)
        # From names of outputs to the impact.
        ways: dict[str, Callable[[Sequence[str]], Impact]] = {
            "fmu": partial(impact_of, ours, law=law),
            "document_fmu": partial(document_impact, document, law, (1e6, *STIFFNESSES), TIME_STEP),
            # Its outputs are always those of an Outcome.
            "scipy": lambda _: lambda k: solve_ivp.solve(Case(law=law, k=k), rtol=1e-12),  # noqa: B023
        }
        for name, fmu in compiled.items():
            ways[f"compiled_{name}"] = partial(impact_of, fmu, law=law, dt=SUB_STEP[name])
        # In a folder of its own, so that its library isn't already loaded by another instance.
        with LoadedFmu(ours.path) as alone:
            ways["simulate_fmu"] = partial(_simulation, alone, law)
            for name, way in ways.items():
                outcome = Outcome(*way(Outcome._fields)(case.k))
                figures[f"impact_by_{name}{suffix}_error"] = max(errors(case, outcome, exact))
            # Of the fast ones so many per round that the first, not yet in caches, don't matter.
            number = {"document_fmu": 1, "simulate_fmu": 2, "scipy": 2}
            jobs = {n: repeated(way(METRICS), number.get(n, 200)) for n, way in ways.items()}
            times = run_interleaved(jobs, rounds)
        figures |= microseconds({f"impact_by_{name}{suffix}": times[name] for name in times})
        for name, spent in times.items():
            over, speedup = (f"impact_{of}_{name}{suffix}" for of in ("over", "speedup_over"))
            if name.startswith("compiled"):
                figures[over] = median_ratio(times["fmu"], spent)
            elif name != "fmu":
                figures[speedup] = median_ratio(spent, times["fmu"])
    return figures


def _simulation(fmu: LoadedFmu, law: int, outputs: Sequence[str]) -> Impact:
    """fmpy.simulate_fmu with one step, as in a loop: extracted and described beforehand."""
    steps = {"stop_time": STEP, "output_interval": STEP}

    def impact(k: float) -> Sequence[float]:
        return [*fmu.simulate(outputs, start_values={"law": law, "k": k}, **steps).values()]

    return impact
