"""Workarounds for hosts and pythonfmu, independent of the model."""
