"""The impact of a golf club on a ball: exact analytic phases, standard library only.

`variables` is the table of what the component shows, `parameters` what values are allowed, the
contact laws are one file each, `impact` is the sequence of phases, and `component` one instance
with its clock, modes and state, whatever interface drives it. All that travels inside the FMU.

Where the whole package is installed, impacts can be run through the FMU from here (SI units):

    >>> import golf_impact
    >>> round(golf_impact.run_impact(law=2)["smash_factor"], 4)
    1.5842
    >>> ball = golf_impact.balls()["roh-lee"]
    >>> path = golf_impact.run_trajectory(points=5, outputs=["force"], **ball.values)
    >>> [round(force) for force in path["force"].tolist()]
    [0, 4928, 6298, 2309, 0]
    >>> with golf_impact.load_fmu() as fmu:
    ...     times = [fmu.impact(["contact_time"], k=k)["contact_time"] for k in (5e5, 1e6)]
    >>> [f"{time * 1e6:.1f} µs" for time in times]
    ['881.9 µs', '619.5 µs']
    >>> study = golf_impact.Study.of({"k": "0.5e6:2e6:100", "b": "0,9,12"})
    >>> golf_impact.run_sweep(study, "k_b.csv").cases
    300
"""

__version__ = "0.1.0"

__all__ = [
    "Ball", "ImpactFmu", "Study", "Summary", "UserError", "balls", "load_fmu", "run_impact",
    "run_sweep", "run_trajectory",
]  # fmt: skip


def __getattr__(name: str) -> object:
    # Looked up when used (PEP 562): whoever wants the physics alone needs nothing else.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from golf_scenarios import api

    return getattr(api, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
