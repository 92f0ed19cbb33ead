"""Targets of the benchmark's figures."""

from typing import NamedTuple


class Limit(NamedTuple):
    """The target of a figure."""

    key: str  #: in bench.json
    meaning: str  #: in words
    value: float  #: at most this, or at least if `rising`
    rising: bool = False  #: whether more is better

    def met(self, figure: float) -> bool:
        return figure >= self.value if self.rising else figure <= self.value

    @property
    def in_words(self) -> str:
        """The target with its sign."""
        return f"{'≥' if self.rising else '≤'} {self.value:g}"


#: One impact's S, COR and E: ratios to other ways, each for law 2 and law 1 (`…_law1`).
_IMPACT = (
    ("impact_over_compiled_euler", "one impact / the document's scheme as FMU in C", 1.15, 1.4),
    ("impact_speedup_over_document_fmu", "… faster than that scheme as Python FMU", 140, 115),
    ("impact_speedup_over_simulate_fmu", "… than simulate_fmu of this FMU", 110, 80),
    ("impact_speedup_over_scipy", "… than DOP853 with events, 1e-12", 85, 65),
)

_SET = "a run whose inputs are set in initialization mode / after it"
_EXTENDED = "an impact in extended precision / one in closed form (0.6 ms / 16.6 µs)"
_READ = "a step read in extended precision / such an impact (40 µs / 16.6 µs)"
CALLS = (
    Limit("do_step_over_empty", "doStep / the empty FMU's", 1.1),
    Limit("step_and_read5_over_empty", "doStep + getReal of 5 in contact / the empty FMU's", 1.03),
    Limit("instantiate_over_empty", "instantiate / an empty FMU with as many variables", 1.3),
    Limit("run_set_in_initialization_over_after", _SET, 1.25),
    Limit("run_law1_over_law2", "such runs, law 1 / law 2", 1.3),
    # On the reference machine an impact in extended precision may take 0.6 ms, and a step that is
    # read 40 µs; an impact of law 1 in closed form takes 16.6 µs. Times differ between machines,
    # ratios within one run of the benchmark don't.
    Limit("unusual_impact_over_usual", _EXTENDED, 36.0),
    Limit("unusual_read_over_usual_run", _READ, 2.4),
)

SWEEPS = (
    Limit("worst_error", "worst error of all reference cases, patterns, results", 1e-13),
    Limit("sweep_speedup_over_simulate_fmu", "sweep to CSV / loop over simulate_fmu", 60, True),
    Limit("sweep_two_workers_over_one", "sweep by two worker processes / by one", 1.7, True),
)

LIMITS = (
    *(
        Limit(f"{key}{suffix}", f"{meaning}, {law}", value, "speedup" in key)
        for key, meaning, *values in _IMPACT
        for suffix, law, value in zip(("", "_law1"), ("law 2", "law 1"), values)
    ),
    *CALLS,
    *SWEEPS,
)
