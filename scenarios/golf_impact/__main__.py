"""`golf-impact`, also as `python -m golf_impact`."""


def main() -> None:
    """The console script."""
    from golf_impact.commands.app import main as command

    command()


if __name__ == "__main__":
    main()
