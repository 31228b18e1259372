"""The protocol with `sdg-bench compare`: one JSON object per line.

worker: {"ready": {"seconds": s, "facts": {...}, "gflop": g, "version": "..."}}    after one run that does not count
driver: {"repeat": n}
worker: {"seconds": s}                                                              n times, of one piece
The end of standard input ends the worker.
"""

import json
import os
import sys
import time
from dataclasses import dataclass, field
from typing import Callable


@dataclass
class Work:
    """A computation to be timed."""

    run: Callable[[], None]
    # Numbers that show what was computed; peers with the same work agree within 1 %.
    facts: dict = field(default_factory=dict)
    # Multiplications and additions in the network's products, in units of 1e9; None if they were not counted.
    gflop: float | None = None
    version: str = ""
    # Number of pieces that one run makes; the answers to `repeat` are per piece.
    pieces: int = 1


def serve(build):
    """Builds the work, warms up and serves runs until standard input ends."""
    # Output of libraries must not get into the protocol.
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)

    def tell(message):
        answers.write(json.dumps(message) + "\n")

    def timed(work):
        start = time.perf_counter()
        work.run()
        return (time.perf_counter() - start) / work.pieces

    work = build()
    whole_run = timed(work) * work.pieces
    ready = {"seconds": whole_run, "facts": work.facts, "gflop": work.gflop, "version": work.version}
    tell({"ready": ready})
    for line in sys.stdin:
        for _ in range(json.loads(line)["repeat"]):
            tell({"seconds": timed(work)})
