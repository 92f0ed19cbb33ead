"""`golf-impact`, also as `python -m golf_impact`."""

from golf_impact import stopping


def main() -> None:
    """The console script; signals are handled before anything slow is imported."""
    stopping.listen()
    from golf_impact.commands.app import main as command

    command()


if __name__ == "__main__":
    main()
