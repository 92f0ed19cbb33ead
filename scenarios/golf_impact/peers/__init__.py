"""Other methods for the same impact."""
