"""The conversation with `sdg-bench compare`, a JSON object a line.

worker: {"ready": {"seconds": s, "facts": {...}, "gflop": g, "version": "..."}}    after one run that does not count
driver: {"repeat": n}
worker: {"seconds": s}                                                              n times
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
    """Something to be timed."""

    run: Callable[[], None]
    # Whoever does the same work has the same numbers, to one part in a hundred.
    facts: dict = field(default_factory=dict)
    # Multiplications and additions of the network's products, 1e9 of them; None where nobody counted.
    gflop: float | None = None
    version: str = ""
    # How many pieces one run makes; times are told for one piece.
    pieces: int = 1


def serve(build):
    """Builds the work, warms up and serves runs until standard input ends."""
    # What libraries print must not get into the conversation.
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
