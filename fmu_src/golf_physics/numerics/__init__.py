"""Zeros, series and quadrature that the contact laws need; each knows nothing of an impact."""
