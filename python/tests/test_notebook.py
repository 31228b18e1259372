"""Tests that the notebook's cells run in order, without Jupyter, and that its picture has the grasp at the part's new position."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

import made_pictures
import sdg
from conftest import ROOT

NOTEBOOK = ROOT / "python" / "notebook" / "photo_to_metres.ipynb"
NUM_CELLS = 10
RED, OUTLINE = (255, 40, 40), (0, 160, 255)


def test_the_notebook_and_the_guide_install_the_wheel_into_an_environment() -> None:
    # Debian's pip installs nothing outside of one.
    guide = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    block = re.search(r"```\nmake wheel\n(.*?)```", guide, re.DOTALL)
    assert block is not None
    make, install = block[1].splitlines()
    assert make == "python3 -m venv sdg-python" and install.startswith("sdg-python/bin/pip install ")
    first = "".join(json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"][0]["source"])
    assert f"`{make}`" in first and f"`{install}`" in first


def test_the_notebook_runs_and_draws_the_grasp(tmp_path: Path) -> None:
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    assert len(cells) == NUM_CELLS
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    # Outputs would be those of an earlier version.
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
    drawn = tmp_path / "drawn.png"
    script = tmp_path / "notebook.py"
    keep = f"Path({str(drawn)!r}).write_bytes(png._repr_png_())"
    script.write_text("\n\n".join(["".join(cell["source"]) for cell in code] + [keep]), encoding="utf-8")
    done = subprocess.run([sys.executable, script], cwd=NOTEBOOK.parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    print("\n" + done.stdout)
    assert "in the frame base: (" in done.stdout

    picture = sdg.read_picture(drawn)
    red = np.argwhere((picture == RED).all(axis=2))
    # The marks' middle, (320, 220.45), moved by 47 to the left and 31 down; pixel centres are at 0.5.
    assert np.allclose(red.mean(axis=0) + 0.5, [251.5, 273.0], atol=1.5)
    rows, columns = np.argwhere((picture == OUTLINE).all(axis=2)).T
    # The marked box, from (259, 168) to (388, 278), moved in the same way; lines are three pixels wide.
    assert np.allclose([columns.min(), columns.max(), rows.min(), rows.max()], [212, 341, 199, 309], atol=4)
    before = np.roll(sdg.read_picture(made_pictures.PHOTO), (31, -47), axis=(0, 1))
    assert (picture == before).all(axis=2).mean() > 0.98
