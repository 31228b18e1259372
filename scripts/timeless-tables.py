#!/usr/bin/env python3
"""Prints the tables of an evaluation's folder without the values that differ from run to run: times, and sizes of files with times."""
import json
import sys
from pathlib import Path

TIMES = {"seconds", "teaching_secs", "longest_teaching_secs", "frames_per_second", "bytes", "largest_bytes"}
TIME_COLUMNS = ("images per second", "teaching, ")


def timeless(value):
    if isinstance(value, dict):
        return {name: timeless(field) for name, field in value.items() if name not in TIMES}
    return [timeless(item) for item in value] if isinstance(value, list) else value


def without_times(text):
    columns, was_row = set(), False
    for line in text.splitlines():
        cells = line.split("|")
        is_row = len(cells) > 1
        if is_row and not was_row:
            columns = {i for i, cell in enumerate(cells) if any(time in cell for time in TIME_COLUMNS)}
        was_row = is_row
        yield "|".join(cell for i, cell in enumerate(cells) if not is_row or i not in columns)


folder = Path(sys.argv[1])
print("\n".join(without_times((folder / "tables.md").read_text())))
print(json.dumps(timeless(json.loads((folder / "tables.json").read_text())), indent=1))
