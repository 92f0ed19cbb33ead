"""`golf-impact calibrate`: from measurements of an impact to the parameters of a contact law.

`measurements` reads and validates the data, `model` evaluates a contact law through the FMU, `fit`
finds its parameters by weighted least squares, `calibration` is the result: compared with other
laws, printed, saved as a ball; `drawing` plots it.
"""
