"""Makes these golden files from Detectron2's own outputs.

    python convert.py SOURCE

SOURCE holds `faster`, `keypoint` and `mask`, each with `weights.pkl` (the model zoo's format), `config.json`,
`input.png` and `expected.safetensors`, written by Detectron2 on the CPU. Weights are copied under the same names;
expected tensors that are equal in all three cases are kept only in `faster`. Needs numpy 2 and
safetensors.
"""

import pathlib
import pickle
import shutil
import sys

from safetensors.numpy import load_file, save_file

source = pathlib.Path(sys.argv[1])
here = pathlib.Path(__file__).parent
for kind in ("faster", "keypoint", "mask"):
    with open(source / kind / "weights.pkl", "rb") as file:
        save_file(pickle.load(file)["model"], here / kind / "weights.safetensors")
    expected = load_file(source / kind / "expected.safetensors")
    if kind != "faster":
        expected = {name: t for name, t in expected.items() if not name.startswith(("preprocessed", "anchors."))}
    save_file(expected, here / kind / "expected.safetensors")
    shutil.copyfile(source / kind / "config.json", here / kind / "config.json")
shutil.copyfile(source / "faster" / "input.png", here / "input.png")
