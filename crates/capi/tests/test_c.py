"""Tests the C library: the same detections as from Rust and Python, to the bit; no error or leak under valgrind; wrong input; the guide.

Models and pictures are those of python/tests.
"""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import made_pictures
import sdg
from conftest import MARK_HEIGHT_MM, ROOT, STEPS
from test_equal import NAMES, as_printed, output, records_by_python, without_seconds_of_teaching

HERE = Path(__file__).resolve().parent
INSTALLED = ROOT / "target" / "capi"
# Programs are 50 times slower under valgrind.
VALGRIND = [
    *("valgrind", "--quiet", "--error-exitcode=99", "--leak-check=full", "--show-leak-kinds=definite,indirect"),
    *("--errors-for-leak-kinds=definite,indirect", "--fair-sched=yes"),
]
ENVIRONMENT = {
    **os.environ,
    "PKG_CONFIG_PATH": str(INSTALLED / "lib" / "pkgconfig"),
    "LD_LIBRARY_PATH": str(INSTALLED / "lib"),
}


def run(*arguments: object, **options: Any) -> str:
    done = subprocess.run(
        [str(argument) for argument in arguments], capture_output=True, text=True, env=ENVIRONMENT, **options
    )
    assert done.returncode == 0, f"{done.returncode}: {done.stdout[-3000:]}{done.stderr[-3000:]}"
    return done.stdout


@pytest.fixture(scope="session")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the compiled programs: C by pkg-config, C++ by CMake."""
    folder = tmp_path_factory.mktemp("programs")
    flags = run("pkg-config", "--cflags", "--libs", "sdg").split()
    for name in ("detect", "bad_input", "teach"):
        run("cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-g", "-o", folder / name, HERE / f"{name}.c", *flags)
    run("cmake", "-S", HERE, "-B", folder / "cmake", f"-DCMAKE_PREFIX_PATH={INSTALLED}")
    run("cmake", "--build", folder / "cmake")
    return folder


@pytest.fixture(scope="session")
def pixels(pictures: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The pixels of the PNG files as PPM files."""
    folder = tmp_path_factory.mktemp("pixels")
    files = {}
    for name, png in pictures.items():
        files[name] = folder / f"{name}.ppm"
        write_ppm(files[name], sdg.read_picture(png))
    return files


def write_ppm(path: Path, picture: made_pictures.Picture) -> None:
    height, width, _ = picture.shape
    path.write_bytes(b"P6 %d %d 255\n" % (width, height) + picture.tobytes())


def records_by_c(
    programs: Path, model: Path, pixels: list[Path], threads: int = 0, under: tuple[str, ...] = ()
) -> list[list[dict[str, Any]]]:
    """The structures' fields as read by the C program, which must equal the JSON written by the library."""
    camera = made_pictures.CAMERA if "camera" in model.stem else "-"
    lines = run(*under, programs / "detect", model, camera, threads, *pixels).splitlines()
    assert len(lines) == 2 * len(pixels)
    by_fields, by_library = ([json.loads(line) for line in lines[first::2]] for first in (0, 1))
    assert by_fields == by_library
    return by_fields


@pytest.mark.parametrize("name", NAMES)
def test_c_equals_rust_python_and_the_program(
    name: str,
    programs: Path,
    models: dict[str, Path],
    pictures: dict[str, Path],
    pixels: dict[str, Path],
    reference: Path,
    sdg_program: Path,
) -> None:
    camera = [made_pictures.CAMERA] if "-camera" in name else []
    by_c = records_by_c(programs, models[name], list(pixels.values()))
    assert by_c == records_by_python(models[name], pictures)

    by_rust = [json.loads(line) for line in output(reference, models[name], *(camera or ["-"]), *pictures.values())]
    # The reference has no `size`.
    assert [[{k: v for k, v in one.items() if k != "size"} for one in found] for found in by_c] == by_rust

    options = [part for file in camera for part in ("--camera", file)]
    arguments = (sdg_program, "detect", "--grasp-model", models[name], "--json", "--all", *options, *pictures.values())
    printed = [json.loads(line)["detections"] for line in output(*arguments)]
    for found in printed:
        for one in found:
            one.pop("advice", None)
    assert printed == as_printed(by_c)
    num_accepted = sum(one["score"] >= 0.5 for found in by_c for one in found)
    print(f"\n{name}: {len(by_c)} pictures, {sum(map(len, by_c))} detections, {num_accepted} of them accepted")
    assert num_accepted > 0


def test_a_mat_of_opencv_has_the_same_pixels(
    programs: Path, models: dict[str, Path], pictures: dict[str, Path], pixels: dict[str, Path]
) -> None:
    lines = run(programs / "cmake" / "opencv", models["S"], *pixels.values()).splitlines()
    assert [json.loads(line) for line in lines] == records_by_python(models["S"], pictures)


# The first model without a camera and the last with one, because each model with a network takes minutes.
@pytest.mark.parametrize("name", [NAMES[0], NAMES[-1]])
def test_valgrind_finds_no_error_and_no_leak(
    name: str, programs: Path, models: dict[str, Path], pixels: dict[str, Path]
) -> None:
    found = records_by_c(programs, models[name], [pixels["photo"]], threads=1, under=tuple(VALGRIND))
    assert len(found[0]) > 0


def test_valgrind_finds_no_error_in_cpp(programs: Path, models: dict[str, Path], pixels: dict[str, Path]) -> None:
    assert json.loads(run(*VALGRIND, programs / "cmake" / "opencv", models["S"], pixels["photo"]))


def test_valgrind_finds_a_leak_where_there_is_one(tmp_path: Path) -> None:
    source = tmp_path / "leak.c"
    source.write_text("#include <stdlib.h>\nint main(void) { volatile char *p = malloc(9); p[0] = 1; p = 0; return 0; }\n")
    run("cc", "-o", tmp_path / "leak", source)
    assert subprocess.run([*VALGRIND, tmp_path / "leak"], capture_output=True).returncode == 99


# For each call's name in bad_input.c: the status, and a part of the text.
BAD_INPUT = {
    "abi_own": (0, ""),
    "abi_old": (10, "expected a program of ABI version 1, found 0: compile the program with this library's sdg.h"),
    "model_missing": (2, "/no/such.sdg: cannot read: No such file or directory"),
    "model_damaged": (3, "damaged.sdg"),
    "model_other_file": (3, "expected a grasp model file"),
    "model_null_path": (1, "expected a pointer as file, found NULL"),
    "model_null_result": (1, "expected a pointer as model, found NULL"),
    "camera_missing": (2, "/no/such.yaml: cannot read"),
    "camera_other_file": (5, "photo.ppm"),
    "model": (0, ""),
    "camera": (0, ""),
    "save_over_picture": (2, "photo.ppm"),
    "picture_old": (10, "expected sdg_picture of ABI version 1, found 0"),
    "options_old": (10, "expected sdg_options of ABI version 1, found 0"),
    "channels": (4, "expected a picture of 3 channels, or of 1 for grey, found 4 channels"),
    "bits": (4, "expected bits_per_channel of 8, found 16"),
    "order": (1, "expected order of SDG_RGB or SDG_BGR, found 2"),
    "no_width": (4, "expected a picture of at least 1 × 1 pixels, found 0 × 480"),
    "too_large": (4, "found 4294967295 × 4294967295"),
    "stride": (4, "expected row_bytes of at least 1920 for 640 pixels of 3, found 1919"),
    "stride_overflow": (4, "found num_bytes of 921600"),
    "too_few_bytes": (4, "expected the bytes of 480 rows of 1920, found num_bytes of 921599"),
    "pixels_null": (1, "expected a pointer as pixels, found NULL"),
    "threads": (1, "expected threads from 1 to 1024, found 5000"),
    "region_kind": (1, "expected region_kind of SDG_REGION_OF_MODEL, _ALL or _PART, found 9"),
    "region": (6, "expected"),
    "camera_of_model_without": (5, "camera"),
    "camera_is_model": (9, ", the handle of a model"),
    "picture_null": (1, "expected a pointer as picture, found NULL"),
    "result_null": (1, "expected a pointer as detections, found NULL"),
    "handle_none": (9, "expected the handle of a model, found 0, which is no handle"),
    "handle_never_given": (9, "found 12345678, which never existed"),
    "handle_of_camera": (9, ", the handle of a camera"),
    "detect": (0, ""),
    "best": (0, ""),
    "best_null": (1, "expected a pointer as found, found NULL"),
    "idx": (1, "found 1000"),
    "polygon_null": (1, "expected a pointer as numbers, found NULL"),
    "polygon_null_for_none": (0, ""),
    "keypoints_null_for_none": (0, ""),
    "free_detections": (0, ""),
    "best_freed": (9, "which was freed"),
    "free_twice": (9, "which was freed"),
    "detect_nothing": (0, ""),
    "best_of_nothing": (8, "expected a part to grasp, found n"),
    "free_nothing": (0, ""),
    "teach_missing": (2, "/no/"),
    "teach_letter": (1, "Z"),
    "teach_millimetres": (1, "expected mark_height_m of 0 to 0.5 metres, found 16"),
    "teach_old": (10, "expected sdg_teaching of ABI version 1, found 0"),
    "teach_null": (1, "expected a pointer as from, found NULL"),
    "free_model": (0, ""),
    "detect_freed": (9, "which was freed"),
    "free_camera": (0, ""),
}


def test_wrong_input_has_one_clear_error_each(
    programs: Path, models: dict[str, Path], pixels: dict[str, Path], tmp_path: Path
) -> None:
    damaged = tmp_path / "damaged.sdg"
    whole = models["S"].read_bytes()
    damaged.write_bytes(whole[: len(whole) // 2])
    lines = run(
        *VALGRIND, programs / "bad_input", models["S"], made_pictures.CAMERA, damaged, pixels["photo"]
    ).splitlines()
    found = {name: (int(status), text) for name, status, text in (line.split("|", 2) for line in lines)}
    assert list(found) == list(BAD_INPUT)
    wrong = {
        name: (found[name], expected)
        for name, expected in BAD_INPUT.items()
        if found[name][0] != expected[0] or expected[1] not in found[name][1]
    }
    assert wrong == {}


@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith("S")])
def test_teaching_writes_the_file_of_python(name: str, programs: Path, models: dict[str, Path], tmp_path: Path) -> None:
    steps = 0 if name.startswith("S") else STEPS
    camera = made_pictures.CAMERA if "-camera" in name else "-"
    out = tmp_path / "taught.sdg"
    run(
        *(programs / "teach", made_pictures.PHOTO, made_pictures.MARKS, name[0], steps),
        *(camera, 1e-3 * MARK_HEIGHT_MM, out),
    )
    assert without_seconds_of_teaching(out) == without_seconds_of_teaching(models[name])


def test_the_guide_runs_as_written(models: dict[str, Path], tmp_path: Path) -> None:
    guide = (ROOT / "docs" / "c.md").read_text(encoding="utf-8")
    [code], [commands] = (re.findall(rf"```{kind}\n(.*?)```", guide, re.DOTALL) for kind in ("c", "sh"))
    assert len([line for line in code.splitlines() if line]) <= 32
    (tmp_path / "guide.c").write_text(code)
    (tmp_path / "target").symlink_to(ROOT / "target")
    shutil.copy(models["S-camera"], tmp_path / "part.sdg")
    shutil.copy(made_pictures.CAMERA, tmp_path / "camera.yaml")
    photo = made_pictures.pictures_of_part()["shifted"]
    (tmp_path / "table.rgb").write_bytes(photo.tobytes())
    done = subprocess.run(["bash", "-ec", commands], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    camera = sdg.Camera.load(made_pictures.CAMERA)
    pose = sdg.GraspModel.load(models["S-camera"]).detect(photo, camera=camera).best.pose
    assert pose is not None
    numbers = [float(number) for number in re.findall(r"-?\d+\.\d+", done.stdout)]
    assert np.allclose(numbers, [*pose.p_m, pose.yaw_deg], atol=0.06)
    assert np.allclose(numbers[:3], pose.p_m, atol=6e-5)
