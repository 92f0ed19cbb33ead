"""What ClubBallImpact.fmu costs, and how exact it is, beside other methods (golf_scenarios.peers).

Two FMUs to hold it against, each packed by pythonfmu from one file alone:

- `empty_fmu`: what a call costs when nothing is computed.
- `empty_wide_fmu`: what instantiating costs with as many variables as ClubBallImpact has.
"""
