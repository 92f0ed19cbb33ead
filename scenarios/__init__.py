"""Scenarios of the golf club–ball impact, driven through the FMU by fmpy.

One file a scenario, with TITLE and run(fmu) -> Outcome; `golf-impact run` runs them. From Python:

    from scenarios.fmu_file import current_fmu
    from scenarios.impact_fmu import ImpactFmu

    path, _ = current_fmu()
    with ImpactFmu(path) as fmu:
        print(fmu.impact(k=8e5, club_speed=42.0)["smash_factor"])
"""
