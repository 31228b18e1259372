"""Tests that the guide's code runs, that the package is typed, documented and within its size limit, and that it has the command."""

import inspect
import json
import os
import re
import shutil
import subprocess
import sys
from importlib import metadata, resources
from pathlib import Path

import numpy as np

import made_pictures
import sdg
from conftest import ROOT

MAX_WHEEL_MB = 25
# "Camera to metres in twenty lines."
MAX_LINES_TO_METRES = 20


def test_the_guide_runs_as_written(tmp_path: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 4
    statements = [line for line in blocks[0].splitlines() if line]
    assert len(statements) <= MAX_LINES_TO_METRES
    for name, file in [
        ("photo.png", made_pictures.PHOTO),
        ("photo.json", made_pictures.MARKS),
        ("camera.yaml", made_pictures.CAMERA),
    ]:
        shutil.copy(file, tmp_path / name)
    # The part at another position: 31 pixels down, 47 to the left.
    made_pictures.write_png(tmp_path / "table.png", made_pictures.pictures_of_part()["shifted"])
    (tmp_path / "guide.py").write_text("\n".join(blocks))
    done = subprocess.run([sys.executable, "guide.py"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    print("\n" + done.stdout)
    # The marks' middle in the photo is (320, 220.45); the table is 0.58 m from the camera, with a focal length of 550 pixels.
    x, y = (float(number) for number in re.search(r"in the picture: \((.*), (.*)\) px", done.stdout).groups())
    assert abs(x - 273) < 1 and abs(y - 251.5) < 1
    forward, left, up = (float(number) for number in re.search(r"frame base: \((.*), (.*), (.*)\) m", done.stdout).groups())
    assert abs(up - 0.009) < 1e-3
    assert "followed" in done.stdout


def test_marks_as_a_dictionary_with_arrays() -> None:
    marks = json.loads(made_pictures.MARKS.read_text())
    for shape in marks["shapes"]:
        shape["points"] = np.array(shape["points"])
    photo = sdg.read_picture(made_pictures.PHOTO)
    [one, other] = (sdg.teach(made_pictures.PHOTO, given, model="S") for given in (marks, made_pictures.MARKS))
    assert one.detect(photo) == other.detect(photo)


def test_everything_public_is_documented() -> None:
    for name in sdg.__all__:
        thing = getattr(sdg, name)
        assert thing.__doc__, name
        if inspect.isclass(thing) and not issubclass(thing, Exception):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or isinstance(value, (property, classmethod))):
                    assert inspect.getdoc(getattr(thing, member)), f"{name}.{member}"


def test_types_hold() -> None:
    assert (resources.files(sdg) / "py.typed").is_file()
    for arguments in (["mypy", "--strict", "--cache-dir", os.devnull, "-p", "sdg"], ["mypy.stubtest", "sdg"]):
        done = subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr


def test_numpy_alone_is_asked_for() -> None:
    assert metadata.requires("single-demo-grasp") == ["numpy"]
    assert metadata.version("single-demo-grasp") == sdg.__version__


def test_the_wheel_is_small_and_for_many_pythons() -> None:
    wheels = list((ROOT / "target" / "wheels").glob(f"single_demo_grasp-{sdg.__version__}-cp39-abi3-manylinux*.whl"))
    assert len(wheels) == 1, wheels
    megabytes = wheels[0].stat().st_size / 1e6
    print(f"\n{wheels[0].name}: {megabytes:.1f} MB")
    assert megabytes <= MAX_WHEEL_MB


def test_the_command_is_there(models: dict[str, Path], pictures: dict[str, Path], tmp_path: Path) -> None:
    command = Path(sys.executable).with_name("sdg")
    run = [str(command), "detect", "--grasp-model", str(models["S"])]
    found = subprocess.run([*run, str(pictures["photo"])], capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert "score" in found.stdout
    nothing = subprocess.run([*run, str(pictures["key"])], capture_output=True, text=True)
    assert nothing.returncode == 3, nothing.stderr
    missing = subprocess.run([*run, str(tmp_path / "missing.png")], capture_output=True, text=True)
    assert missing.returncode == 1
    assert missing.stderr.startswith("sdg: ") and missing.stderr.count("\n") == 1
    for not_built in (["demo"], ["simulate", "--fci"]):
        done = subprocess.run([str(command), *not_built], capture_output=True, text=True)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
        assert "built without the simulator" in done.stderr, done.stderr
    wrong = subprocess.run([str(command), "detect", "--no-such-option"], capture_output=True, text=True)
    assert wrong.returncode == 2
