"""The command line: ``flexarm`` or ``python -m flexarm``."""

import signal
import sys


def main() -> int:
    """Run the command line of this process."""
    from . import _flexarm

    # The command takes the process for its own: what it does not look at ends it, as of any
    # program.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stdout.flush()
    return _flexarm.run_command(["flexarm", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
