"""`golf-impact calibrate`: from measurements of an impact to the parameters of a contact law.

`measurements` reads and validates the data, `fit` finds the parameters by weighted least squares
through the FMU, `calibration` is the result, `drawing` plots it.
"""
