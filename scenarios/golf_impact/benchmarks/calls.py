"""FMI calls of ClubBallImpact.fmu beside those of an FMU that computes nothing; other runs."""

from functools import partial
from typing import Any

from golf_impact.benchmarks import impact
from golf_impact.benchmarks.empty_fmu import OUTPUTS as READ
from golf_impact.benchmarks.impact import METRICS, STEP, impact_of
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.timing import Job, measure_seconds, median_ratio, run_interleaved

_SPEEDS = ("club_velocity", "ball_velocity")

#: Damping from which law 1 needs extended precision, N.s/m (ζ = 2.6).
_HEAVY: dict[str, Any] = {"law": 1, "b": 1000.0}


def call_ratios(ours: LoadedFmu, empty: LoadedFmu, rounds: int) -> dict[str, float]:
    """Ratios of medians by key, and times of a call, or of a run, in µs (`…_us`)."""
    jobs = {
        "step_empty": _steps(empty),
        "read_empty": _steps(empty, moving=READ),
        "instantiate": _instantiating(ours),
        "instantiate_empty": _instantiating(empty),
        "unusual_impact": impact.repeated(impact_of(ours, METRICS, 10.0 * STEP, **_HEAVY), 5),
        # As many as take as long as the runs that they are compared with, so that a busy machine
        # affects both equally; the contact is solved beforehand.
        "unusual_read": _steps(ours, 100, 2e-6, moving=("force", *_SPEEDS), begin=1e-5, **_HEAVY),
    }
    for law in (1, 2):
        jobs[f"step_{law}"] = _steps(ours, law=law)
        jobs[f"read_{law}"] = _steps(ours, moving=READ, law=law)
        for when in ("in", "after"):
            jobs[f"run_set_{when}_initialization_law{law}"] = _runs(ours, law, when == "in")
    times = run_interleaved(jobs, rounds)

    def ratio(job: str, other: str) -> float:
        return median_ratio(times[job], times[other])

    in_1, in_2, after_1, after_2 = (
        f"run_set_{when}_initialization_law{law}" for when in ("in", "after") for law in (1, 2)
    )
    return {
        "do_step_over_empty": max(ratio(f"step_{law}", "step_empty") for law in (1, 2)),
        "step_and_read5_over_empty": max(ratio(f"read_{law}", "read_empty") for law in (1, 2)),
        "instantiate_over_empty": ratio("instantiate", "instantiate_empty"),
        "run_set_in_initialization_over_after": max(ratio(in_1, after_1), ratio(in_2, after_2)),
        "run_law1_over_law2": max(ratio(in_1, in_2), ratio(after_1, after_2)),
        "unusual_impact_over_usual": ratio("unusual_impact", after_1),
        "unusual_read_over_usual_run": ratio("unusual_read", after_1),
        **impact.microseconds(times),
    }


def _steps(fmu: LoadedFmu, number: int = 600, step: float = 1e-6, **options: Any) -> Job:
    """Time of a doStep and its reads, s, by default over the baseline's contact (`impact_of`)."""
    begin = options.get("begin", 0.0)
    points = [begin + n * step for n in range(number)]
    run = impact_of(fmu, (), step, lambda _: points, **options)
    return partial(measure_seconds, partial(run, 1e6), number)


def _instantiating(fmu: LoadedFmu) -> Job:
    """instantiate() of fmpy, s; its object is made and the instance freed off the clock."""
    fmu.instance()  # the library and its modules stay loaded, whatever is freed

    def job() -> float:
        slaves = [fmu.new_instance() for _ in range(5)]
        time = measure_seconds(lambda: [slave.instantiate() for slave in slaves], len(slaves))
        for slave in slaves:
            fmu.free(slave)
        return time

    return job


def _runs(fmu: LoadedFmu, law: int, in_initialization: bool) -> Job:
    """A restored state, k, b and club_speed set, one step and two reads, s."""
    fmu.begin({"law": law})
    if not in_initialization:
        fmu.end_initialization()
    slave, start = fmu.slave, fmu.slave.getFMUstate()
    inputs, metrics, speeds = map(fmu.references, (("k", "b", "club_speed"), METRICS, _SPEEDS))

    def runs() -> None:
        for k in impact.STIFFNESSES:
            slave.setFMUstate(start)
            slave.setReal(inputs, [k, 9.0, 35.0])
            if in_initialization:
                slave.exitInitializationMode()
            slave.doStep(0.0, STEP)
            slave.getReal(metrics)
            slave.getReal(speeds)

    return partial(measure_seconds, runs, len(impact.STIFFNESSES))
