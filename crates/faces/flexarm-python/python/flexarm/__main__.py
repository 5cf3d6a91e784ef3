"""The command line: ``flexarm`` or ``python -m flexarm``."""

import signal
import sys


def main() -> int:
    """Run the command line of this process."""
    from . import _flexarm

    # Without Python's handler, Ctrl-C ends the process unless the command handles it.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stdout.flush()
    return _flexarm.run_command(["flexarm", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
