"""Zeros, series and quadrature for the contact laws; nothing here depends on an impact."""
