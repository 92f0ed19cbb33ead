"""`golf-impact`, also as `python -m golf_scenarios`."""

from golf_scenarios import stopping


def main() -> None:
    """The console script: signals are answered before anything slow is imported."""
    stopping.listen()
    from golf_scenarios.commands.app import main as command

    command()


if __name__ == "__main__":
    main()
