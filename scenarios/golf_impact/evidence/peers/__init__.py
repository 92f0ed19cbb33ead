"""Other methods for the same impact, and an FMU that computes nothing: what `bench` compares."""
