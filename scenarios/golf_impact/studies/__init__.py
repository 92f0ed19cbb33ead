"""Questions that take many impacts: sweeps, sensitivities, intervals, calibration, drives."""
