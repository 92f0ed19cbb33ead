"""Run time and accuracy of ClubBallImpact.fmu and of other methods (golf_impact.peers).

- `calls`: calls, beside an FMU in which nothing is computed (`empty_fmu`); other runs.
- `impact`, `sweep_rate`: an impact, and many. · `work_precision`: run time against error.
- `accuracy`: the worst error of all reference cases. · `native`: FMUs in a host in C. · `all`: all
  but that, and the targets, limits.csv.
"""
