"""`golf-impact calibrate`: from measurements of an impact to the parameters of a ball."""
