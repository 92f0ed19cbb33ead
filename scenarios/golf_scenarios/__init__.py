"""What the scenarios are made with: driving the FMU, facts to hold it against, report, commands."""

import os
import sys

# A script that is run puts its folder before Python's own modules, and one of them is named
# `compression`, as a package of Python 3.14 is.
if sys.path and os.path.abspath(sys.path[0]) == os.path.dirname(os.path.dirname(__file__)):
    sys.path.append(sys.path.pop(0))
