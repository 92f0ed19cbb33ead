"""`golf-impact`, also as `python -m golf_impact`."""

import os


def main() -> None:
    """The console script. Ctrl-C ends it without a traceback, also while modules are imported."""
    try:
        from golf_impact.commands.app import main as command

        command()
    except KeyboardInterrupt:
        os.write(2, b"Stopped; nothing half-written is left.\n")
        os._exit(130)


if __name__ == "__main__":
    main()
