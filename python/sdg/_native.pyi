"""The native part: its arguments are checked by the package's Python code, and records are JSON."""

from os import PathLike
from typing import Literal, Optional, Union, final

import numpy as np
import numpy.typing as npt

_Path = Union[str, PathLike[str]]
_Array = npt.NDArray[np.uint8]
_Bounds = tuple[int, int, int, int]
# True is the whole picture.
_Region = Optional[Union[_Bounds, Literal[True]]]

__all__ = ["Camera", "Model", "Tracker", "VERSION", "evaluate", "read_picture", "run_command", "teach"]

VERSION: str

@final
class Camera:
    @staticmethod
    def load(path: _Path) -> Camera: ...
    @staticmethod
    def from_yaml(text: str) -> Camera: ...
    @property
    def size_px(self) -> tuple[int, int]: ...
    @property
    def frame(self) -> Optional[str]: ...

@final
class Model:
    @staticmethod
    def load(path: _Path) -> Model: ...
    def save(self, path: _Path) -> None: ...
    @property
    def kind(self) -> str: ...
    @property
    def object(self) -> str: ...
    def detect(
        self,
        array: _Array,
        channels: str,
        camera: Optional[Camera],
        region: _Region,
        threads: Optional[int],
        min_score: float,
    ) -> str: ...

@final
class Tracker:
    def __new__(
        cls,
        model: Model,
        camera: Optional[Camera],
        region: _Region,
        threads: Optional[int],
        search_frames: Optional[int],
    ) -> Tracker: ...
    def frame(self, array: _Array, channels: str, captured_s: float) -> str: ...
    def close(self) -> None: ...

def teach(
    demonstrations: list[tuple[_Path, _Path]],
    model: str,
    preset: str,
    seed: int,
    steps: Optional[int],
    time_budget_s: Optional[float],
    symmetry: int,
    size_tolerance: tuple[float, float],
    region: Optional[_Bounds],
    camera: Optional[tuple[_Path, float, float]],
    negatives: list[_Path],
) -> tuple[Model, list[str]]: ...
def evaluate(
    model: Model,
    folder: _Path,
    camera: Optional[Camera],
    region: _Region,
    threads: Optional[int],
    label: Optional[str],
    min_score: float,
    report: _Path,
) -> str: ...
def read_picture(path: _Path, camera: Optional[Camera]) -> tuple[int, int, bytearray]: ...
def run_command(arguments: list[str]) -> int: ...
