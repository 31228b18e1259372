#!/usr/bin/env python3
"""Writes detectron2.pkl, a fixture of crate weights-conversion with fewer tensors, each of a few numbers.

    pip install numpy==2.4.6
    python make_checkpoint.py

Reading the fixture takes 9,800 operations of the pickle's machine, reading this file 1,200.
"""

import pickle
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
FIXTURE = HERE.parents[1] / "weights-conversion" / "tests" / "fixtures" / "detectron2_keypoint.pkl"


def is_kept(name):
    return "anchor" in name or name.startswith(("backbone.bottom_up.stem.", "backbone.bottom_up.res2.0.", "roi_heads.box_"))


if __name__ == "__main__":
    checkpoint = pickle.loads(FIXTURE.read_bytes(), encoding="latin1")
    model = {
        name: np.ascontiguousarray(array[tuple(slice(2) for _ in array.shape)])
        for name, array in checkpoint["model"].items()
        if is_kept(name)
    }
    content = pickle.dumps({"model": model, "__author__": checkpoint["__author__"]}, protocol=2)
    (HERE / "detectron2.pkl").write_bytes(content)
