"""What `bench` and `stress` compare the FMU with: reference, checks, other methods."""
