"""`golf-impact calibrate`: from measurements of an impact to the parameters of a contact law.

`targets` reads and refuses measurements, `contact_law` says what a law predicts (through the FMU),
`fitting` finds its parameters, `calibrate` compares laws and shows and writes what was found.
"""
