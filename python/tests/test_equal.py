"""Compares grasps with those from Rust, to the bit, and with `sdg detect --json --all`, to the last printed digit."""

import json
import math
import os
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import made_pictures
import sdg
from conftest import MARK_HEIGHT_MM, STEPS

LETTERS = os.environ.get("SDG_MODELS", "S,C").split(",")
NAMES = [name for letter in LETTERS for name in (letter, f"{letter}-camera")]
# Records have the same fields as the program's, except for the advice, which names options.
OF_PROGRAM_ALONE = {"advice"}


def records_by_python(model: Path, pictures: dict[str, Path]) -> list[list[dict[str, Any]]]:
    camera = sdg.Camera.load(made_pictures.CAMERA) if "camera" in model.stem else None
    loaded = sdg.GraspModel.load(model)
    found = []
    for path in pictures.values():
        detections = loaded.detect(sdg.read_picture(path, camera), camera=camera)
        found.append([one.record for one in [*detections, *detections.refused]])
    return found


def output(*arguments: object) -> list[str]:
    done = subprocess.run([str(argument) for argument in arguments], capture_output=True, text=True)
    # 3: nothing to grasp in any picture.
    assert done.returncode in (0, 3), done.stderr
    return done.stdout.splitlines()


def as_printed(value: Any) -> Any:
    """Rounds numbers to six decimals like the program: half away from zero."""
    if isinstance(value, float):
        return math.copysign(math.floor(abs(value) * 1e6 + 0.5) / 1e6, value) + 0.0
    if isinstance(value, list):
        return [as_printed(one) for one in value]
    if isinstance(value, dict):
        return {name: as_printed(one) for name, one in value.items()}
    return value


@pytest.mark.parametrize("name", NAMES)
def test_python_equals_rust_and_the_program(
    name: str, models: dict[str, Path], pictures: dict[str, Path], reference: Path, sdg_program: Path
) -> None:
    camera = "-camera" in name
    by_python = records_by_python(models[name], pictures)
    paths = list(pictures.values())

    by_rust = output(reference, models[name], made_pictures.CAMERA if camera else "-", *paths)
    assert len(by_rust) == len(paths)
    for picture, line, records in zip(pictures, by_rust, by_python):
        rust = json.loads(line)
        assert len(rust) == len(records), picture
        for one, other in zip(rust, records):
            # The reference has no `size`. Numbers of both are in the shortest text that represents them exactly.
            assert one == {key: value for key, value in other.items() if key != "size"}, picture

    options = ["--camera", made_pictures.CAMERA] if camera else []
    by_program = output(sdg_program, "detect", "--grasp-model", models[name], "--json", "--all", *options, *paths)
    assert len(by_program) == len(paths)
    for picture, line, records in zip(pictures, by_program, by_python):
        printed = json.loads(line)["detections"]
        for one in printed:
            for field in OF_PROGRAM_ALONE:
                one.pop(field, None)
        assert printed == [as_printed(record) for record in records], picture

    num_found = sum(len(records) for records in by_python)
    num_accepted = sum(record["score"] >= 0.5 for records in by_python for record in records)
    print(f"\n{name}: {len(paths)} pictures, {num_found} detections, {num_accepted} of them accepted")
    # At least one detection was compared, including poses.
    assert num_accepted > 0
    assert all(("pose" in record) == camera for records in by_python for record in records if record["score"] >= 0.5)


@pytest.mark.parametrize("letter", LETTERS)
def test_teaching_writes_the_file_of_the_program(
    letter: str, models: dict[str, Path], sdg_program: Path, tmp_path: Path
) -> None:
    steps = [] if letter == "S" else ["--steps", STEPS]
    demonstration = f"{made_pictures.PHOTO}:{made_pictures.MARKS}"
    camera = ["--camera", made_pictures.CAMERA, "--mark-height-mm", MARK_HEIGHT_MM]
    for name, options in [(letter, []), (f"{letter}-camera", camera)]:
        out = tmp_path / f"{name}.sdg"
        output(sdg_program, "teach", "--demo", demonstration, "--model", letter, "--out", out, *steps, *options)
        assert without_seconds_of_teaching(out) == without_seconds_of_teaching(models[name]), name


def without_seconds_of_teaching(file: Path) -> tuple[str, bytes]:
    """The header and the tensors of a model file, without the duration of its teaching, which always differs."""
    content = file.read_bytes()
    length = int.from_bytes(content[:8], "little")
    header, num_times = re.subn(r'\\"seconds\\":[0-9.e-]+', "", content[8 : 8 + length].decode())
    assert num_times == 1, header
    # The header is padded with spaces.
    return header.rstrip(), content[8 + length :]


def test_parts_that_the_jaws_would_touch_are_the_program_s(
    shape_model: sdg.GraspModel, models: dict[str, Path], sdg_program: Path, tmp_path: Path
) -> None:
    picture = made_pictures.touching()
    made_pictures.write_png(tmp_path / "touching.png", picture)
    line, *_ = output(sdg_program, "detect", "--grasp-model", models["S"], "--json", tmp_path / "touching.png")
    printed = [one.get("jaws_touch", []) for one in json.loads(line)["detections"]]
    assert [one.jaws_touch for one in shape_model.detect(picture)] == printed == [[1], [0]]
    # Jaws touch no refused part.
    refused = shape_model.detect(picture, min_score=1.0).refused
    assert [one.jaws_touch for one in refused] == [[]] * len(refused)


def test_several_photos_are_taught_as_by_the_program(sdg_program: Path, tmp_path: Path) -> None:
    turned = tmp_path / "turned.png"
    made_pictures.write_png(turned, sdg.read_picture(made_pictures.PHOTO)[::-1, ::-1])
    marks = json.loads(Path(made_pictures.MARKS).read_text(encoding="utf-8"))
    marks["imagePath"] = turned.name
    for shape in marks["shapes"]:
        shape["points"] = [[marks["imageWidth"] - x, marks["imageHeight"] - y] for x, y in shape["points"]]
    file = tmp_path / "turned.json"
    file.write_text(json.dumps(marks), encoding="utf-8")
    taught = sdg.teach(made_pictures.PHOTO, made_pictures.MARKS, model="S", more_demos=[(turned, marks)])
    taught.save(tmp_path / "python.sdg")
    demos = ["--demo", f"{made_pictures.PHOTO}:{made_pictures.MARKS}", "--demo", f"{turned}:{file}"]
    output(sdg_program, "teach", *demos, "--model", "S", "--out", tmp_path / "program.sdg")
    of_both = [without_seconds_of_teaching(tmp_path / name) for name in ("python.sdg", "program.sdg")]
    assert of_both[0] == of_both[1]


def test_strides_channels_and_grey_are_the_same_pixels(shape_model: sdg.GraspModel) -> None:
    photo = sdg.read_picture(made_pictures.PHOTO)
    expected = shape_model.detect(photo)
    assert expected.best.refused is None
    wide = np.zeros((480, 1280, 4), np.uint8)
    wide[:, ::2, :3] = photo
    backwards = np.ascontiguousarray(photo[::-1, ::-1])
    for same, channels in [
        (photo[:, :, ::-1], "bgr"),
        (wide[:, ::2, :3], "rgb"),
        (backwards[::-1, ::-1], "rgb"),
        (np.asfortranarray(photo), "rgb"),
    ]:
        assert shape_model.detect(same, channels=channels) == expected
    grey = photo[:, :, 1]
    assert shape_model.detect(grey) == shape_model.detect(np.repeat(grey[:, :, None], 3, axis=2))
    read_only = photo.copy()
    read_only.flags.writeable = False
    assert shape_model.detect(read_only) == expected


def test_the_number_of_threads_changes_nothing(shape_model: sdg.GraspModel) -> None:
    photo = sdg.read_picture(made_pictures.PHOTO)
    one, three = (shape_model.detect(photo, threads=threads) for threads in (1, 3))
    assert one == three == shape_model.detect(photo)


def test_a_region_is_searched_alone(shape_model: sdg.GraspModel) -> None:
    twice = made_pictures.pictures_of_part()["twice"]
    everywhere = shape_model.detect(twice, region="all")
    assert len(everywhere) == 2
    left = shape_model.detect(twice, region=(0, 0, 320, 240))
    assert len(left) == 1
    assert left.best.grasp.x < 320 and left.best.grasp.y < 240


def test_a_region_replaces_that_of_the_model_with_a_camera_of_other_pictures() -> None:
    model = sdg.teach(
        made_pictures.PHOTO,
        made_pictures.MARKS,
        model="S",
        region=(220, 140, 200, 200),
        camera=made_pictures.CAMERA,
        mark_height_mm=MARK_HEIGHT_MM,
    )
    text = made_pictures.CAMERA.read_text()
    camera = sdg.Camera.from_yaml(text.replace("width: 640", "width: 600").replace("height: 480", "height: 450"))
    cut = np.ascontiguousarray(sdg.read_picture(made_pictures.PHOTO)[:450, :600])
    with pytest.raises(sdg.RegionError, match="640 × 480"):
        model.detect(cut, camera=camera)
    assert len(model.detect(cut, camera=camera, region="all")) == 1


def test_a_tracker_follows_the_part(shape_model: sdg.GraspModel) -> None:
    photo = sdg.read_picture(made_pictures.PHOTO)
    with sdg.Tracker(shape_model, search_frames=1) as tracker:
        for idx in range(4):
            parts = tracker.frame(np.roll(photo, 3 * idx, axis=1), captured_s=idx / 30)
            assert [part.state for part in parts] == ["followed"], idx
            if idx == 0:
                first = parts[0]
    assert parts[0].track == first.track
    assert parts[0].age_s == pytest.approx(0.1)
    assert parts[0].grasp.x - first.grasp.x == pytest.approx(9, abs=0.5)


def test_a_tracker_tells_which_parts_the_jaws_would_touch(shape_model: sdg.GraspModel) -> None:
    with sdg.Tracker(shape_model, search_frames=1) as tracker:
        parts = tracker.frame(made_pictures.touching(), captured_s=0.0)
    assert [part.jaws_touch for part in parts] == [[1], [0]]


def test_evaluation_counts_as_the_program_does(
    models: dict[str, Path], sdg_program: Path, pictures: dict[str, Path], tmp_path: Path
) -> None:
    folder = tmp_path / "labelled"
    folder.mkdir()
    # Changed pixels, because the photo itself would be left out; the marks are the same.
    (folder / "noisy.png").write_bytes(pictures["noisy"].read_bytes())
    marks = json.loads(made_pictures.MARKS.read_text())
    marks["imagePath"] = "noisy.png"
    (folder / "noisy.json").write_text(json.dumps(marks))
    figures = sdg.evaluate(sdg.GraspModel.load(models["S"]), folder, report=tmp_path / "python")
    assert (tmp_path / "python" / "index.html").is_file()
    [line] = output(
        *(sdg_program, "evaluate", "--grasp-model", models["S"], "--pictures", folder),
        *("--json", "--report", tmp_path / "program"),
    )
    of_program = json.loads(line)
    assert figures["found"] == figures["parts"] == 1
    # A model in Python need not come from a file.
    for key in figures.keys() - {"report", "grasp_model"}:
        assert as_printed(without_seconds(figures[key])) == without_seconds(of_program[key]), key


def test_labels_of_another_part_are_told(
    shape_model: sdg.GraspModel, pictures: dict[str, Path], tmp_path: Path
) -> None:
    (tmp_path / "noisy.png").write_bytes(pictures["noisy"].read_bytes())
    marks = made_pictures.MARKS.read_text().replace(f'"label": "{made_pictures.PART}"', '"label": "bolt"')
    (tmp_path / "noisy.json").write_text(marks)
    with pytest.warns(UserWarning, match="all labels are 'bolt', the model's part is 'pendulum': they count as the part"):
        figures = sdg.evaluate(shape_model, tmp_path)
    assert (figures["foreign_label"], figures["parts"]) == ("bolt", 1)
    figures = sdg.evaluate(shape_model, tmp_path, label=made_pictures.PART)
    assert (figures["foreign_label"], figures["parts"]) == (None, 0)


def without_seconds(value: Any) -> Any:
    if isinstance(value, list):
        return [without_seconds(one) for one in value]
    if isinstance(value, dict):
        return {name: without_seconds(one) for name, one in value.items() if "seconds" not in name}
    return value
