"""The command `sdg`, in this process: the wheel has one copy of the program."""

import signal
import sys

from . import _native


def main() -> int:
    """Runs `sdg` with this process's arguments; its exit code."""
    # Ctrl-C ends the program as it ends any other; Python would wait for its own code to go on.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.run_command(["sdg", *sys.argv[1:]])
