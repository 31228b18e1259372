"""Teach a robot a grasp from one photo, and detect it in pictures, in pixels and in metres.

    model = sdg.teach("part.png", "part.json", model="S")
    best = model.detect(sdg.read_picture("table.png")).best
    print(best.grasp.x, best.grasp.y, best.grasp.angle_deg)

Arrays are numpy arrays of dtype uint8 and shape (height, width, 3), or (height, width) for grey, with any strides. They are
copied once, and the GIL is released during computations. Units are in the names: metres (`_m`), degrees (`_deg`).
"""

from __future__ import annotations

import json
import re
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import inf
from os import PathLike, fspath
from operator import index
from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np

from . import _native
from ._detections import Detection, Detections, Grasp, Pose, TrackedPart
from ._errors import (
    ArgumentError,
    CameraError,
    ClosedError,
    FileError,
    ForkedError,
    ModelFileError,
    NothingToGrasp,
    PictureError,
    RegionError,
    SdgError,
    TeachingError,
    VersionError,
)

__version__ = "0.1.0"
if _native.VERSION != __version__:
    raise VersionError(
        f"expected a native part of version {__version__}, found {_native.VERSION}: install single-demo-grasp again",
        name="sdg._native",
    )

__all__ = [
    "ArgumentError",
    "Camera",
    "CameraError",
    "ClosedError",
    "Detection",
    "Detections",
    "FileError",
    "ForkedError",
    "Grasp",
    "GraspModel",
    "ModelFileError",
    "NothingToGrasp",
    "PictureError",
    "Pose",
    "RegionError",
    "SdgError",
    "TeachingError",
    "TrackedPart",
    "Tracker",
    "VersionError",
    "evaluate",
    "read_picture",
    "teach",
]

if TYPE_CHECKING:
    # numpy 1.19, which Debian 11 has, lacks this module.
    import numpy.typing as npt

    _Array = npt.NDArray[np.uint8]

_Path = Union[str, "PathLike[str]"]
_Region = Union[None, str, Sequence[int]]

_MAX_THREADS = 1024
_MAX_STEPS = 1_000_000
_MAX_SEED = 2**64 - 1
_MAX_SEARCH_FRAMES = 10_000


class Camera:
    """A calibrated camera with its pose relative to the table."""

    def __init__(self, native: _native.Camera) -> None:
        self._native = native

    @classmethod
    def load(cls, path: _Path) -> "Camera":
        """Reads ROS camera_info YAML with the camera's pose (`table:`), written by `sdg camera calibrate` and `sdg camera table`.

        Raises FileError and CameraError.
        """
        return cls(_native.Camera.load(_path("path", path)))

    @classmethod
    def from_yaml(cls, text: str) -> "Camera":
        """Reads a camera from the text of a file. Raises CameraError."""
        if not isinstance(text, str):
            raise ArgumentError(f"expected the text of a camera file, found {_type(text)}")
        return cls(_native.Camera.from_yaml(text))

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the camera's pictures, in pixels."""
        return self._native.size_px

    @property
    def frame(self) -> Optional[str]:
        """The frame of poses: "table" or "base"."""
        return self._native.frame


class GraspModel:
    """A model of a taught part. It can be shared between threads."""

    def __init__(self, native: _native.Model) -> None:
        self._native = native

    @classmethod
    def load(cls, path: _Path) -> "GraspModel":
        """Reads a model file. Raises FileError and ModelFileError."""
        return cls(_native.Model.load(_path("path", path)))

    def save(self, path: _Path) -> None:
        """Writes the model file atomically; it replaces only an existing grasp model. Raises FileError."""
        self._native.save(_path("path", path))

    @property
    def model(self) -> str:
        """The model's letter: S, A, B, C or D."""
        return self._native.kind

    @property
    def object(self) -> str:
        """The part's name."""
        return self._native.object

    def detect(
        self,
        array: _Array,
        channels: str = "rgb",
        camera: Optional[Camera] = None,
        region: _Region = None,
        threads: Optional[int] = None,
        min_score: float = 0.5,
    ) -> Detections:
        """Detects the part in a picture.

        array: uint8 of shape (height, width, 3), or (height, width) for grey; any strides.
        channels: "rgb", or "bgr" for arrays of OpenCV.
        camera: the calibrated camera that took it, for poses in metres; the model must have been taught with one.
        region: (left, upper, width, height) in pixels, "all", or None for the region that the model was taught with.
        threads: number of threads; None for one per core.
        min_score: minimum score of accepted detections; the others are in `.refused` of the result.

        Raises PictureError, CameraError, RegionError and ArgumentError. For a picture without the part, the list is empty, and
        its `.best` raises NothingToGrasp.
        """
        min_score = _number("min_score", min_score, 0, 1)
        found = self._native.detect(
            _checked(array),
            _channels(channels),
            _native_of(camera),
            _checked_region(region),
            _checked_threads(threads),
            min_score,
        )
        return Detections([Detection.of(record) for record in json.loads(found)], min_score)

    def __repr__(self) -> str:
        return f"GraspModel(model={self.model!r}, object={self.object!r})"


class Tracker:
    """Tracks parts from frame to frame; searches run on a separate thread. As a context manager it closes itself."""

    def __init__(
        self,
        model: GraspModel,
        camera: Optional[Camera] = None,
        region: _Region = None,
        threads: Optional[int] = None,
        search_frames: Optional[int] = None,
    ) -> None:
        """camera, region and threads are those of `GraspModel.detect`.

        search_frames: number of frames after which the result of a search is used, for results that are the same on every
        machine; None to use it as soon as the search has ended.
        """
        if search_frames is not None:
            search_frames = _whole("search_frames", search_frames, 0, _MAX_SEARCH_FRAMES)
        self._native = _native.Tracker(
            _native_model(model), _native_of(camera), _checked_region(region), _checked_threads(threads), search_frames
        )

    def frame(self, array: _Array, captured_s: float, channels: str = "rgb") -> list[TrackedPart]:
        """The parts in the next frame, including lost ones.

        array, channels: as in `GraspModel.detect`; captured_s: seconds since any fixed time.

        Raises ClosedError after `close`, and the exceptions of `GraspModel.detect`.
        """
        captured_s = _number("captured_s", captured_s)
        records = json.loads(self._native.frame(_checked(array), _channels(channels), captured_s))
        return [TrackedPart.of(record) for record in records]

    def close(self) -> None:
        """Closes the tracker; waits for a running search."""
        self._native.close()

    def __enter__(self) -> "Tracker":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_picture(path: _Path, camera: Optional[Camera] = None) -> _Array:
    """Reads PNG, JPEG, WebP, BMP or TIFF like the program: uint8 of shape (height, width, 3), red first.

    camera: the calibrated camera that took the picture. With a camera, the sensor's orientation is kept; with None, the
    picture is upright (Exif).

    Raises FileError and PictureError.
    """
    height, width, pixels = _native.read_picture(_path("path", path), _native_of(camera))
    return np.frombuffer(pixels, np.uint8).reshape(height, width, 3)


def teach(
    photo: _Path,
    marks: Union[_Path, Mapping[str, Any]],
    model: str = "C",
    *,
    preset: str = "edge",
    seed: int = 1,
    steps: Optional[int] = None,
    time_budget_s: Optional[float] = None,
    symmetry: Union[int, str] = 1,
    size_tolerance: tuple[float, float] = (0.75, 1.35),
    region: Optional[Sequence[int]] = None,
    camera: Optional[_Path] = None,
    mark_height_mm: Optional[float] = None,
    grasp_height_mm: Optional[float] = None,
    negatives: Sequence[_Path] = (),
    more_demos: Sequence[tuple[_Path, Union[_Path, Mapping[str, Any]]]] = (),
) -> GraspModel:
    """Teaches a model from one photo or several, with the defaults of `sdg teach`. Ctrl-C ends the teaching.

    photo: the file of the photo. marks: a file of marks (COCO, LabelMe, YOLO-pose), or the contents of such a JSON file
    as a dictionary. model: S, which takes seconds, or A, B, C or D, which have a network and take half a minute or
    more. steps, time_budget_s: maximum steps and seconds of the network's training. symmetry: number of angles at which
    the part looks the same, or "full". size_tolerance: minimum and maximum size of the part in a picture, relative to
    its size in the photo; with a calibrated camera, 0.9 to 1.11 times the part's size is searched instead. region:
    (left, upper, width, height) in pixels of the photo. camera: the file of the calibrated camera that took the photo,
    for grasps in metres. mark_height_mm, grasp_height_mm: heights of the marks and of the grasp above the table, with a
    camera; grasp_height_mm defaults to half of mark_height_mm. negatives: files of pictures without the part; a warning
    names each one in which the model still accepts something. Where warnings are errors, the model would be lost:
    then call this within `warnings.catch_warnings()`, after `warnings.simplefilter("default")`. more_demos: further
    photos of the part, each with its marks, like photo and marks.

    Raises FileError, PictureError, TeachingError, CameraError, RegionError and ArgumentError.
    """
    if (camera is None) != (mark_height_mm is None):
        raise ArgumentError("expected camera and mark_height_mm together, found one without the other")
    if grasp_height_mm is not None and camera is None:
        raise ArgumentError("expected camera with grasp_height_mm, found the height alone")
    if time_budget_s is not None and not 0 < _number("time_budget_s", time_budget_s) < 1e9:
        raise ArgumentError(f"expected time_budget_s of more than 0 and less than 1e9 seconds, found {time_budget_s}")
    of_camera = None
    if camera is not None and mark_height_mm is not None:
        mark_mm = _height_mm("mark_height_mm", mark_height_mm)
        grasp_mm = 0.5 * mark_mm if grasp_height_mm is None else _height_mm("grasp_height_mm", grasp_height_mm)
        of_camera = (_path("camera", camera), 1e-3 * mark_mm, 1e-3 * grasp_mm)
    # 0 for full symmetry.
    turns = 0
    if symmetry != "full":
        if isinstance(symmetry, str):
            raise ArgumentError(f'expected symmetry from 1 to 360 equal turns, or "full", found {symmetry!r}')
        turns = _whole("symmetry", symmetry, 1, 360)
    seed = _whole("seed", seed, 0, _MAX_SEED)
    if steps is not None:
        steps = _whole("steps", steps, 1, _MAX_STEPS)
    smallest, largest = (
        _number("size_tolerance", size) for size in _pair("size_tolerance=(smallest, largest)", size_tolerance)
    )
    if not (0.5 <= smallest <= 1 <= largest <= 2):
        raise ArgumentError(
            f"expected size_tolerance=(smallest, largest), from 0.5 to 1 and from 1 to 2, found {size_tolerance}"
        )
    bounds = None if region is None else _bounds(region)
    for name, text in [("model", model), ("preset", preset)]:
        if not isinstance(text, str):
            raise ArgumentError(f"expected {name}, a string, found {_type(text)}")
    pairs = {"": (photo, marks)}
    for number, demo in enumerate(_list("more_demos", more_demos)):
        pairs[f"more_demos[{number}] "] = _pair("more_demos of pairs (photo, marks)", demo)
    with _temporary_folder(any(isinstance(of_marks, Mapping) for _, of_marks in pairs.values())) as folder:
        demonstrations: list[tuple[_Path, _Path]] = []
        for number, (where, (of_photo, of_marks)) in enumerate(pairs.items()):
            of_photo = _path(f"{where}photo", of_photo)
            if isinstance(of_marks, Mapping):
                of_marks = _file_of(of_marks, Path(folder, str(number), f"{where}marks of {Path(of_photo).stem}.json"))
            demonstrations.append((of_photo, _path(f"{where}marks, a dictionary", of_marks)))
        try:
            taught, accepted_negatives = _native.teach(
                demonstrations,
                model,
                preset,
                seed,
                steps,
                time_budget_s,
                turns,
                (smallest, largest),
                bounds,
                of_camera,
                [_path("negatives", path) for path in _list("negatives", negatives)],
            )
        except SdgError as error:
            if not folder:
                raise
            # The caller does not know the files in this folder.
            raise type(error)(re.sub(rf"{re.escape(folder)}/\d+/(.*?)\.json", r"\1", str(error))) from None
    for accepted in accepted_negatives:
        warnings.warn(accepted, stacklevel=2)
    return GraspModel(taught)


def evaluate(
    model: GraspModel,
    folder: _Path,
    camera: Optional[Camera] = None,
    region: _Region = None,
    threads: Optional[int] = None,
    label: Optional[str] = None,
    min_score: float = 0.5,
    report: Optional[_Path] = None,
) -> dict[str, Any]:
    """Evaluates a model on a folder of labelled pictures: the figures of `sdg evaluate --pictures --json`.

    report: a folder for a page with every picture; None for no page.

    A warning says that all labels have one name which is not the model's part, and count as the part: `foreign_label` in
    the figures.

    Raises TeachingError for invalid labels, and the exceptions of `GraspModel.detect`.
    """
    if label is not None and not isinstance(label, str):
        raise ArgumentError(f"expected label, a string, found {_type(label)}")
    with _temporary_folder(report is None) as unkept:
        figures: dict[str, Any] = json.loads(
            _native.evaluate(
                _native_model(model),
                _path("folder", folder),
                _native_of(camera),
                _checked_region(region),
                _checked_threads(threads),
                label,
                _number("min_score", min_score, 0, 1),
                _path("report", unkept if report is None else report),
            )
        )
    if figures["foreign_label"] is not None:
        part = figures["object"]
        warnings.warn(
            f"all labels are {figures['foreign_label']!r}, the model's part is {part!r}: they count as the part; "
            f"label={part!r} counts the pictures as without it",
            stacklevel=2,
        )
    if report is None:
        del figures["report"]
    return figures


@contextmanager
def _temporary_folder(is_needed: bool) -> Iterator[str]:
    """A temporary folder, which the system may refuse; "" if none is needed."""
    if not is_needed:
        yield ""
        return
    try:
        folder = tempfile.TemporaryDirectory()
    except OSError as error:
        raise FileError(f"expected a folder for temporary files, found none: {error}") from None
    with folder as path:
        yield path


def _type(value: object) -> str:
    return type(value).__name__


def _native_of(camera: Optional[Camera]) -> Optional[_native.Camera]:
    if camera is None:
        return None
    if not isinstance(camera, Camera):
        raise CameraError(f"expected an sdg.Camera (Camera.load reads one from a file), found {_type(camera)}")
    return camera._native


def _native_model(model: GraspModel) -> _native.Model:
    if not isinstance(model, GraspModel):
        raise ArgumentError(f"expected an sdg.GraspModel (GraspModel.load reads one from a file), found {_type(model)}")
    return model._native


def _path(name: str, value: _Path) -> str:
    try:
        path = fspath(value)
    except TypeError:
        path = None
    if not isinstance(path, str):
        raise ArgumentError(f"expected {name}, a str or a pathlib.Path, found {_type(value)}")
    return path


def _list(name: str, values: Any) -> list[Any]:
    # A string would be read letter by letter.
    if isinstance(values, (str, bytes, Mapping)) or not isinstance(values, Iterable):
        raise ArgumentError(f"expected {name}, a list, found {_type(values)}")
    return list(values)


def _pair(what: str, values: Any) -> tuple[Any, Any]:
    found = _list(what, values)
    if len(found) != 2:
        raise ArgumentError(f"expected {what}, found {values!r}")
    return found[0], found[1]


def _number(name: str, value: Any, least: float = -inf, most: float = inf) -> float:
    """A number of any type of Python or numpy, within bounds."""
    number = None
    if not isinstance(value, str):
        try:
            number = float(value)
        except (TypeError, ValueError):
            pass
        except OverflowError:
            raise ArgumentError(f"expected {name}, a number of at most 1.8e308, found a larger one") from None
    if number is None:
        raise ArgumentError(f"expected {name}, a number, found {value!r}")
    if not least <= number <= most and (least, most) != (-inf, inf):
        raise ArgumentError(f"expected {name} from {least:g} to {most:g}, found {value}")
    return number


def _height_mm(name: str, value: Any) -> float:
    """A height above the table that was given; one below 0.1 mm was given in metres."""
    height_mm = _number(name, value)
    if not (height_mm == 0 or 0.1 <= height_mm <= 500):
        raise ArgumentError(f"expected {name} of 0 to 500 millimetres, found {height_mm}: metres given as millimetres?")
    return height_mm


def _channels(channels: str) -> str:
    if not isinstance(channels, str):
        raise ArgumentError(f'expected channels "rgb" or "bgr", found {_type(channels)}')
    return channels


def _file_of(marks: Mapping[str, Any], path: Path) -> Path:
    """Writes marks to a file; numpy's arrays and numbers become lists and numbers."""

    def plain(value: Any) -> Any:
        if isinstance(value, (np.ndarray, np.generic)):
            return value.tolist()
        raise ArgumentError(f"expected marks with the contents of a JSON file, found {_type(value)}")

    try:
        text = json.dumps(marks, default=plain)
    except SdgError:
        raise
    except (TypeError, ValueError, RecursionError) as error:
        # For example, keys that are no strings, or a dictionary that contains itself.
        raise ArgumentError(f"expected marks with the contents of a JSON file, found others: {error}") from None
    try:
        path.parent.mkdir()
        path.write_text(text, encoding="utf-8")
    except (OSError, ValueError) as error:
        # For example, a full disk, or a photo whose name is too long.
        raise FileError(f"the marks cannot be written to a temporary file: {error}") from None
    return path


def _checked(array: Any) -> _Array:
    """Checks an array and returns it as exactly numpy.ndarray, without a copy."""
    if not isinstance(array, np.ndarray):
        raise PictureError(f"expected a numpy.ndarray, found {_type(array)}")
    return np.asarray(array)


def _checked_region(region: _Region) -> Any:
    """None, True for the whole picture, or four numbers."""
    if region is None:
        return None
    if isinstance(region, str):
        if region != "all":
            raise RegionError(f'expected region=(left, upper, width, height) or "all", found {region!r}')
        return True
    return _bounds(region)


def _bounds(region: Sequence[int]) -> tuple[int, int, int, int]:
    try:
        left, upper, width, height = (index(number) for number in region)
    except (TypeError, ValueError):
        left = upper = width = height = -1
    if not all(0 <= number < 2**32 for number in (left, upper, width, height)):
        raise RegionError(f"expected region=(left, upper, width, height) in whole pixels of the picture, found {region!r}")
    return left, upper, width, height


def _checked_threads(threads: Optional[int]) -> Optional[int]:
    return None if threads is None else _whole("threads", threads, 1, _MAX_THREADS)


def _whole(name: str, value: int, least: int, most: int) -> int:
    """An integer of any type of Python or numpy, within bounds."""
    try:
        number = index(value)
    except TypeError:
        number = None
    if number is None or not least <= number <= most:
        raise ArgumentError(f"expected {name}, a whole number from {least} to {most}, found {value!r}")
    return number
