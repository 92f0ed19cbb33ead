"""`golf-impact calibrate`: from measurements of an impact to the parameters of a ball."""

from golf_impact.data.errors import missing_package

try:
    import lmfit  # noqa: F401
except ModuleNotFoundError:
    raise missing_package("calibrate", "lmfit", "calibrate") from None
