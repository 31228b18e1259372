"""Tests that wrong input raises an exception of a specific class, with the expected and the found value."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest

import made_pictures
import sdg

GREY = np.zeros((480, 640, 3), np.uint8)
CIRCULAR: dict[str, Any] = {}
CIRCULAR["shapes"] = CIRCULAR


class Subclass(np.ndarray):
    """Could return an address other than its own."""


@pytest.mark.parametrize(
    "array, words",
    [
        (GREY.astype(np.float32), "expected an array of dtype uint8, found float32"),
        (GREY.astype(np.int8), "expected an array of dtype uint8, found int8"),
        (GREY.astype(bool), "expected an array of dtype uint8, found bool"),
        (GREY.astype(object), "expected an array of dtype uint8, found object"),
        (GREY[0, 0], "found [3]"),
        (GREY[None], "expected an array of shape (height, width, 3), or (height, width) for grey, found [1, 480, 640, 3]"),
        (GREY[:, :, :2], "expected a picture of 3 channels, or of 1 for grey, found 2 channels"),
        (np.zeros((480, 640, 4), np.uint8), "found 4 channels"),
        (np.zeros((3, 480, 640), np.uint8), "found 640 channels"),
        (np.zeros((0, 640, 3), np.uint8), "expected a picture of at least 1 × 1 pixels, found 640 × 0"),
        (np.broadcast_to(np.uint8(0), (1 << 20, 1 << 20)), "found 1048576 × 1048576"),
        (np.zeros((2, 3, 3), np.uint8), "found 3 × 2"),
        (GREY.tolist(), "expected a numpy.ndarray, found list"),
        (GREY.tobytes(), "expected a numpy.ndarray, found bytes"),
        (None, "expected a numpy.ndarray, found NoneType"),
        ("table.png", "expected a numpy.ndarray, found str"),
    ],
)
def test_arrays_that_are_no_pictures(array: Any, words: str, shape_model: sdg.GraspModel) -> None:
    with pytest.raises(sdg.PictureError) as raised:
        shape_model.detect(array)
    assert words in str(raised.value)


def test_a_subclass_is_read_as_the_array_that_it_is(shape_model: sdg.GraspModel) -> None:
    photo = sdg.read_picture(made_pictures.PHOTO)
    assert shape_model.detect(photo.view(Subclass)) == shape_model.detect(photo)


def test_a_picture_of_nothing(shape_model: sdg.GraspModel) -> None:
    found = shape_model.detect(np.full((480, 640, 3), 128, np.uint8))
    assert found == []
    with pytest.raises(sdg.NothingToGrasp, match="expected a part to grasp, found n"):
        found.best


def refused_model_file(content: bytes, folder: Path) -> str:
    file = folder / "model.sdg"
    file.write_bytes(content)
    with pytest.raises(sdg.ModelFileError) as raised:
        sdg.GraspModel.load(file)
    assert str(file) in str(raised.value)
    return str(raised.value)


def test_damaged_model_files(models: dict[str, Path], tmp_path: Path) -> None:
    whole = models["S"].read_bytes()
    middle = len(whole) // 2
    flipped = whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]
    for content in (whole[: len(whole) // 2], whole[:20], flipped):
        refused_model_file(content, tmp_path)
    assert "expected a grasp model file" in refused_model_file(made_pictures.PHOTO.read_bytes(), tmp_path)
    refused_model_file(b"", tmp_path)


def test_paths_that_do_not_exist(shape_model: sdg.GraspModel, tmp_path: Path) -> None:
    missing = tmp_path / "missing"
    calls: list[Callable[[], object]] = [
        lambda: sdg.GraspModel.load(missing),
        lambda: sdg.GraspModel.load(str(missing)),
        lambda: sdg.Camera.load(missing),
        lambda: sdg.read_picture(missing),
        lambda: sdg.teach(missing, made_pictures.MARKS, model="S"),
        lambda: sdg.teach(made_pictures.PHOTO, missing, model="S"),
        lambda: sdg.evaluate(shape_model, missing),
        lambda: shape_model.save(missing / "model.sdg"),
    ]
    for call in calls:
        with pytest.raises(sdg.FileError, match="missing") as raised:
            call()
        # Like other file errors of Python.
        assert isinstance(raised.value, OSError)


def test_temporary_files_that_cannot_be_written(
    shape_model: sdg.GraspModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(sdg.FileError, match="marks cannot be written"):
        sdg.teach("p" * 300, {"shapes": []}, model="S")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    # Without marks as a dictionary, no temporary file is needed.
    assert sdg.teach(made_pictures.PHOTO, made_pictures.MARKS, model="S").model == "S"
    calls: list[Callable[[], object]] = [
        lambda: sdg.teach(made_pictures.PHOTO, {"shapes": []}, model="S"),
        lambda: sdg.evaluate(shape_model, tmp_path),
    ]
    for call in calls:
        with pytest.raises(sdg.FileError, match="expected a folder for temporary files, found none: .*missing"):
            call()


def test_a_model_replaces_no_other_file(shape_model: sdg.GraspModel, tmp_path: Path) -> None:
    picture = tmp_path / "picture.png"
    picture.write_bytes(made_pictures.PHOTO.read_bytes())
    with pytest.raises(sdg.FileError):
        shape_model.save(picture)
    assert picture.read_bytes() == made_pictures.PHOTO.read_bytes()


def test_pictures_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(sdg.PictureError):
        sdg.read_picture(made_pictures.MARKS)
    cut = tmp_path / "cut.png"
    cut.write_bytes(made_pictures.PHOTO.read_bytes()[:5000])
    with pytest.raises(sdg.PictureError, match="cut.png"):
        sdg.read_picture(cut)


def test_cameras(models: dict[str, Path], shape_model: sdg.GraspModel) -> None:
    text = made_pictures.CAMERA.read_text()
    camera = sdg.Camera.from_yaml(text)
    assert camera.size_px == (640, 480) and camera.frame == "base"
    for wrong in ("", "image_width: 640\n", text.replace("table:", "floor:")):
        with pytest.raises(sdg.CameraError):
            sdg.Camera.from_yaml(wrong)
    with pytest.raises(sdg.CameraError, match="image.png"):
        sdg.Camera.load(made_pictures.PHOTO)
    photo = sdg.read_picture(made_pictures.PHOTO, camera)
    # Taught without a camera, so only in pixels.
    with pytest.raises(sdg.CameraError):
        shape_model.detect(photo, camera=camera)
    with pytest.raises(sdg.PictureError, match="640 × 480"):
        sdg.GraspModel.load(models["S-camera"]).detect(photo[:470], camera=camera)


@pytest.mark.parametrize("region", [(0, 0, 641, 480), (0, 0, 0, 5), (0, 0, 5), (-1, 0, 50, 50), (0.5, 0, 50, 50), "left"])
def test_regions(region: Any, shape_model: sdg.GraspModel) -> None:
    with pytest.raises(sdg.RegionError, match="expected"):
        shape_model.detect(GREY, region=region)


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"channels": "hsv"}, 'found "hsv"'),
        ({"threads": 0}, "expected threads, a whole number from 1 to 1024, found 0"),
        ({"threads": 1.5}, "found 1.5"),
        ({"threads": 1 << 30}, "found 1073741824"),
        ({"min_score": 1.5}, "min_score from 0 to 1, found 1.5"),
        ({"min_score": float("nan")}, "min_score from 0 to 1, found nan"),
        ({"min_score": "high"}, "expected min_score, a number, found 'high'"),
        ({"min_score": 10**400}, "expected min_score, a number of at most 1.8e308"),
        ({"channels": None}, 'expected channels "rgb" or "bgr", found NoneType'),
    ],
)
def test_arguments_of_detect(arguments: dict[str, Any], words: str, shape_model: sdg.GraspModel) -> None:
    with pytest.raises(sdg.ArgumentError) as raised:
        shape_model.detect(GREY, **arguments)
    assert words in str(raised.value)


@pytest.mark.parametrize(
    "arguments",
    [
        {"model": "Z"},
        {"preset": "huge"},
        {"symmetry": 0},
        {"symmetry": "half"},
        {"symmetry": 2.5},
        {"steps": 0},
        {"seed": -1},
        {"time_budget_s": -1.0},
        {"time_budget_s": float("nan")},
        {"size_tolerance": (1.4, 0.8)},
        {"mark_height_mm": 10.0},
        {"grasp_height_mm": 10.0},
        {"camera": made_pictures.CAMERA, "mark_height_mm": 0.01},
        {"camera": made_pictures.CAMERA, "mark_height_mm": "16"},
        {"camera": 7, "mark_height_mm": 16},
        {"model": 5},
        {"size_tolerance": 1.2},
        {"size_tolerance": (0.8, None)},
        {"negatives": "negative.png"},
        {"negatives": [None]},
        {"more_demos": ["a"]},
        {"more_demos": [(made_pictures.PHOTO, None)]},
        {"photo": GREY},
        {"marks": None},
        {"marks": {"shapes": {1, 2}}},
        {"marks": {("shapes",): []}},
        {"marks": CIRCULAR},
    ],
)
def test_arguments_of_teach(arguments: dict[str, Any]) -> None:
    with pytest.raises(sdg.ArgumentError, match="expected"):
        sdg.teach(**{"photo": made_pictures.PHOTO, "marks": made_pictures.MARKS, "model": "S", **arguments})


def test_bounds_of_arguments_are_named_and_hold_for_given_values_only(tmp_path: Path) -> None:
    arguments: dict[str, Any] = {"photo": made_pictures.PHOTO, "marks": tmp_path / "missing", "model": "S"}
    with pytest.raises(sdg.ArgumentError, match="of more than 0 and less than 1e9 seconds, found 2000000000.0"):
        sdg.teach(**arguments, time_budget_s=2e9)
    # The grasp's height is then half of this, 0.075 mm.
    with pytest.raises(sdg.FileError, match="missing"):
        sdg.teach(**arguments, camera=made_pictures.CAMERA, mark_height_mm=0.15)
    with pytest.raises(sdg.ArgumentError, match="expected grasp_height_mm of 0 to 500 millimetres, found 0.075"):
        sdg.teach(**arguments, camera=made_pictures.CAMERA, mark_height_mm=16, grasp_height_mm=0.075)


def test_paths_and_objects_of_another_type(shape_model: sdg.GraspModel) -> None:
    anything: Any = "part.sdg"
    with pytest.raises(sdg.CameraError, match="expected an sdg.Camera .*, found str"):
        shape_model.detect(GREY, camera=anything)
    with pytest.raises(sdg.CameraError, match="found str"):
        sdg.read_picture(made_pictures.PHOTO, anything)
    calls: list[Callable[[], object]] = [
        lambda: sdg.Tracker(anything),
        lambda: sdg.evaluate(anything, "folder"),
        lambda: sdg.evaluate(shape_model, None),  # type: ignore[arg-type]
        lambda: sdg.evaluate(shape_model, "folder", label=anything.encode()),
        lambda: sdg.GraspModel.load(None),  # type: ignore[arg-type]
        lambda: sdg.Camera.from_yaml(b""),  # type: ignore[arg-type]
        lambda: shape_model.save(None),  # type: ignore[arg-type]
    ]
    for call in calls:
        with pytest.raises(sdg.ArgumentError, match="expected .*, found (str|NoneType|bytes)"):
            call()


def test_a_model_that_was_read_can_be_replaced(models: dict[str, Path], tmp_path: Path) -> None:
    file = tmp_path / "model.sdg"
    file.write_bytes(models["S"].read_bytes())
    model = sdg.GraspModel.load(file)
    model.save(file)
    assert sdg.GraspModel.load(file).object == model.object


def test_the_best_below_an_own_limit_names_it(shape_model: sdg.GraspModel) -> None:
    found = shape_model.detect(sdg.read_picture(made_pictures.PHOTO), min_score=1.0)
    with pytest.raises(sdg.NothingToGrasp, match=r"score of at least 1 \(min_score\), found 0\.9\d\d\d at most"):
        found.best


def test_marks_that_nothing_can_be_taught_from() -> None:
    for marks in ({}, {"shapes": []}):
        with pytest.raises(sdg.TeachingError, match="^marks of image: .*expected"):
            sdg.teach(made_pictures.PHOTO, marks, model="S")
    with pytest.raises(sdg.TeachingError):
        sdg.teach(made_pictures.PHOTO, made_pictures.DEMONSTRATIONS / "key" / "image.png", model="S")


def test_a_negative_with_the_part_is_told(tmp_path: Path) -> None:
    # The photo with one changed pixel: the photo itself is refused.
    picture = sdg.read_picture(made_pictures.PHOTO).copy()
    picture[0, 0] = 0
    negative = tmp_path / "negative.png"
    made_pictures.write_png(negative, picture)
    with pytest.warns(UserWarning) as told:
        sdg.teach(made_pictures.PHOTO, made_pictures.MARKS, model="S", negatives=[negative])
    [text] = [str(one.message) for one in told]
    file = re.escape(str(negative))
    assert re.fullmatch(rf"negative {file}: still accepted with [01]\.\d\d: does it show the part\?", text), text


def test_trackers(shape_model: sdg.GraspModel) -> None:
    tracker = sdg.Tracker(shape_model)
    for unusable in (float("nan"), float("inf")):
        with pytest.raises(sdg.ArgumentError, match="captured_s to be finite, found"):
            tracker.frame(GREY, captured_s=unusable)
    # The first time may be any.
    tracker.frame(GREY, captured_s=-1.0)
    tracker.frame(GREY, captured_s=1.0)
    with pytest.raises(sdg.ArgumentError, match="captured_s of at least 1, the previous frame's, found 0.5"):
        tracker.frame(GREY, captured_s=0.5)
    tracker.close()
    with pytest.raises(sdg.ClosedError, match="found one that was closed"):
        tracker.frame(GREY, captured_s=2.0)
    tracker.close()


FORKED = """
import os, signal, sys
import sdg
model, picture = sdg.GraspModel.load(sys.argv[1]), sdg.read_picture(sys.argv[2])

def in_a_fork(work):
    if os.fork() == 0:
        # A process that waits for threads which do not exist is ended.
        signal.alarm(60)
        try:
            print("found", len(work()), flush=True)
        except sdg.ForkedError as error:
            print(error, flush=True)
        os._exit(0)
    os.wait()

def detect(threads):
    in_a_fork(lambda: model.detect(picture, threads=threads))

# Loading takes one thread per core, so that other threads can be made in a fork.
detect(None)
detect(1)
in_a_fork(lambda: [sdg.teach(sys.argv[2], sys.argv[3], model="S")])
model.detect(picture)
detect(None)
detect(1)
# Its search thread does not exist in a fork.
tracker = sdg.Tracker(model)
in_a_fork(lambda: tracker.frame(picture, captured_s=0.0))
in_a_fork(lambda: tracker.close() or [])
tracker.close()
"""


def test_a_forked_process_is_told_instead_of_waiting_for_ever(models: dict[str, Path]) -> None:
    files = [models["S"], made_pictures.PHOTO, made_pictures.MARKS]
    arguments = [sys.executable, "-c", FORKED, *map(str, files)]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[1] == "found 1", lines
    assert all("expected a new process (spawn)" in lines[k] for k in (0, 2, 3, 4, 5)), lines
    assert lines[6] == "found 0", lines


def test_every_exception_is_of_this_package() -> None:
    errors = [value for name, value in vars(sdg).items() if isinstance(value, type) and issubclass(value, Exception)]
    assert len(errors) == 12
    assert all(issubclass(error, sdg.SdgError) for error in errors)
