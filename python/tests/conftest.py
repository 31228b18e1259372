"""Common fixtures: programs of `make test-python`, models that are taught once, pictures as files."""

import os
from pathlib import Path

import pytest

import made_pictures
import sdg

ROOT = Path(__file__).resolve().parents[2]
# Height of the pendulum's marks above the table: datasets/objects/pendulum.
MARK_HEIGHT_MM = 16.0
# Enough steps to show that C's network is used; the quality of its training is tested in Rust.
STEPS = 10


def program(variable: str, built: str) -> Path:
    path = Path(os.environ.get(variable, ROOT / "target" / "release" / built))
    if not path.is_file():
        pytest.fail(f"expected {path}: run `make test-python`, or set {variable}")
    return path


@pytest.fixture(scope="session")
def sdg_program() -> Path:
    """The program of `make build`."""
    return program("SDG_PROGRAM", "sdg")


@pytest.fixture(scope="session")
def reference() -> Path:
    """crates/bindings/examples/reference.rs, which does not use the bindings."""
    return program("SDG_REFERENCE", "examples/reference")


@pytest.fixture(scope="session")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Files of models taught by Python: S and C, each also with a camera (S-camera, C-camera)."""
    folder = tmp_path_factory.mktemp("models")
    files = {}
    for letter in os.environ.get("SDG_MODELS", "S,C").split(","):
        steps = None if letter == "S" else STEPS
        for name, camera, height in [(letter, None, None), (f"{letter}-camera", made_pictures.CAMERA, MARK_HEIGHT_MM)]:
            files[name] = folder / f"{name}.sdg"
            sdg.teach(
                made_pictures.PHOTO,
                made_pictures.MARKS,
                model=letter,
                steps=steps,
                camera=camera,
                mark_height_mm=height,
            ).save(files[name])
    return files


@pytest.fixture(scope="session")
def shape_model(models: dict[str, Path]) -> sdg.GraspModel:
    """Model S, without a camera."""
    return sdg.GraspModel.load(models["S"])


@pytest.fixture(scope="session")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Files of the test pictures."""
    folder = tmp_path_factory.mktemp("pictures")
    files = {}
    for name, picture in made_pictures.pictures_of_part().items():
        files[name] = folder / f"{name}.png"
        made_pictures.write_png(files[name], picture)
    return files
