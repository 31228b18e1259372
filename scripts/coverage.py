#!/usr/bin/env python3
"""Prints the percentages of lines and regions of crates that tests reached, without the lines of the tests.

coverage.py ROOT LCOV JSON CRATE…: LCOV and JSON are outputs of `llvm-cov export`, for lines and for regions.
FILES=1 in the environment: also prints files, with the lines that no test reached.
"""
import json
import os
import re
import sys
from collections import defaultdict
from pathlib import Path

root, lcov, functions, *crates = sys.argv[1:]
root = Path(root)


def crate_of(file):
    parts = Path(file).parts
    inside = Path(file).is_relative_to(root / "crates")
    name = Path(file).relative_to(root / "crates").parts[0] if inside else None
    is_test = "tests" in parts or parts[-1] in ("tests.rs", "test_support.rs")
    return name if name in crates and not is_test else None


first_test_line = {}


def is_counted(file, line):
    """Whether a line counts. Tests are at the end of a file, in a module under `#[cfg(test)]`."""
    if file not in first_test_line:
        text = Path(file).read_text()
        found = re.search(r"^#\[cfg\(test\)\]\n(#.*\n)*mod \w+ \{", text, re.M)
        first_test_line[file] = text.count("\n", 0, found.start()) + 1 if found else 10**9
    return line < first_test_line[file]


# File and line: number of executions.
lines = defaultdict(dict)
file = None
for row in open(lcov):
    if row.startswith("SF:"):
        file = row[3:].strip()
        if not crate_of(file):
            file = None
    elif row.startswith("DA:") and file:
        line, count = map(int, row[3:].split(",")[:2])
        if is_counted(file, line):
            lines[file][line] = max(count, lines[file].get(line, 0))

# A generic function is compiled once per type: a region counts as reached if it was reached for one type.
regions = defaultdict(int)
for function in json.load(open(functions))["data"][0]["functions"]:
    for l1, c1, l2, c2, count, file_idx, _, kind in function["regions"]:
        file = function["filenames"][file_idx]
        if kind == 0 and crate_of(file) and is_counted(file, l1):
            regions[file, l1, c1, l2, c2] = max(count, regions[file, l1, c1, l2, c2])

print("| crate | lines | reached | regions | reached |\n|---|--:|--:|--:|--:|")
for crate in crates:
    counts = [count for file in lines if crate_of(file) == crate for count in lines[file].values()]
    of_crate = [count for (file, *_), count in regions.items() if crate_of(file) == crate]
    share = lambda counts: f"{len(counts):,} | {100 * sum(count > 0 for count in counts) / max(len(counts), 1):.1f} %"
    print(f"| `{crate}` | {share(counts)} | {share(of_crate)} |")

if os.environ.get("FILES"):
    for file in sorted(lines, key=lambda file: -sum(count == 0 for count in lines[file].values())):
        missed = [line for line, count in sorted(lines[file].items()) if count == 0]
        if missed:
            print(f"{Path(file).relative_to(root)}: {len(missed)} of {len(lines[file])}: {' '.join(map(str, missed))}")
