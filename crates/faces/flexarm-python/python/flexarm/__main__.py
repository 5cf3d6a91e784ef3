"""The command line: ``flexarm`` or ``python -m flexarm``."""

import signal
import sys


def main() -> int:
    """Run the command line of this process."""
    from . import _flexarm

    # The command owns the process: Ctrl-C ends it wherever the command does not handle it, as in
    # any other program.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stdout.flush()
    return _flexarm.run_command(["flexarm", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
