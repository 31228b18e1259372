"""The command `sdg`, in this process: the wheel has one copy of the program."""

import signal
import sys

from . import _native


def main() -> int:
    """Runs `sdg` with this process's arguments and returns its exit code."""
    # Ctrl-C ends the program like any other; Python would only react when its own code continues.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.run_command(["sdg", *sys.argv[1:]])
