"""Common parts of the FMI adapters, workarounds for hosts and pythonfmu; nothing of the model."""
