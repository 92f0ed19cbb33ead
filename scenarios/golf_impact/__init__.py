"""Run, check and plot impacts of a golf club on a ball (SI units).

    >>> import golf_impact
    >>> round(golf_impact.run_impact(law=2)["smash_factor"], 4)
    1.5842
    >>> impacts = golf_impact.run_impacts(["smash_factor"], law=2, b=[0.0, 9.0, 18.0])
    >>> impacts["smash_factor"].round(3)
    array([1.641, 1.584, 1.533])
    >>> slopes = golf_impact.sensitivities(["ball_velocity"], wrt=["club_speed"], law=2)
    >>> round(slopes["ball_velocity"]["club_speed"].item(), 4)
    1.5842
    >>> ball = golf_impact.balls()["roh-lee"]
    >>> path = golf_impact.run_trajectory(points=5, outputs=["force"], **ball.values)
    >>> [round(force) for force in path["force"].tolist()]
    [0, 4928, 6301, 2310, 0]
    >>> with golf_impact.Impact() as impact:
    ...     times = [impact(["contact_time"], k=k)["contact_time"] for k in (5e5, 1e6)]
    >>> [f"{time * 1e6:.1f} µs" for time in times]
    ['881.9 µs', '619.5 µs']
    >>> golf_impact.calibrate(cor=0.743, contact_time=600e-6)
    Calibration: Kelvin–Voigt (law 2)
      k = 914000 ± 19000 N/m
      b = 37.3 ± 1.3 N·s/m
      χ² = 0, degrees of freedom 0
    >>> table = golf_impact.sweep({"law": 2, "k": "0.5e6:2e6:100", "b": "0,9,12"})
    >>> table["smash_factor"].shape
    (300,)

A scenario script imports `golf_impact.scenario`; the console script is `golf_impact.__main__`.
"""

#: The modules of the public names; their types are in __init__.pyi.
_MODULES = {
    "Ball": "data.balls", "read_ball": "data.balls", "UserError": "data.errors",
    "Impact": "fmu", "balls": "api",
    "run_impact": "api", "run_impacts": "api", "run_trajectory": "api",
    "sensitivities": "studies.sensitivities", "sweep": "studies.sweep.sweep",
    "drive": "studies.drive", "calibrate": "studies.calibrate.calibration",
    "Calibration": "studies.calibrate.calibration",
}  # fmt: skip

__all__ = sorted(_MODULES)


def __getattr__(name: str) -> object:
    # Imported on first use (PEP 562): the command line starts without NumPy and FMPy.
    if name == "__version__":
        from golf_build import VERSION

        return VERSION
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"golf_impact.{_MODULES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})
