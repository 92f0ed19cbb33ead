"""`golf-impact`, also as `python -m scenarios`."""

from scenarios import stopping


def main() -> None:
    """The console script: signals are answered before anything slow is imported."""
    stopping.listen()
    from scenarios.cli import main as command

    command()


if __name__ == "__main__":
    main()
