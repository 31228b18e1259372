"""Detections in a picture, with the field names of `sdg detect --json`."""

from dataclasses import dataclass, field
from typing import Any, Optional

from ._errors import NothingToGrasp


@dataclass(frozen=True)
class Grasp:
    """Position of the grasp, in pixels of the picture: x right, y down, the centre of the first pixel at (0.5, 0.5)."""

    x: float
    y: float
    angle_deg: float
    """Direction from the first mark to the second, in (-180, 180], y down; the jaws close across it."""
    width_px: float
    """The part's width between the jaws."""


@dataclass(frozen=True)
class Pose:
    """Pose of the grasp in the frame of the camera file, in metres and degrees."""

    frame: str
    """"table" or "base", as given in the camera file."""
    p_m: tuple[float, float, float]
    yaw_deg: float
    """Rotation about the frame's z, right-handed."""
    opening_m: float
    sigma_mm: float
    """The position is within this distance with a probability of 68 %."""
    sigma_deg: float


@dataclass(frozen=True)
class Detection:
    """A candidate position of the part."""

    score: float
    """Calibrated, from 0 to 1; accepted from 0.5."""
    grasp: Grasp
    pose: Optional[Pose]
    """None without a camera."""
    evidence: dict[str, float]
    """The components of the score, in log-odds."""
    refused: Optional[str]
    """The reason for a score below 0.5, in words; None for a higher score. It does not depend on `min_score`."""
    box: tuple[float, float, float, float]
    """Left, upper, right and lower edge, in pixels."""
    polygon: list[tuple[float, float]]
    """The outline's corners, in pixels."""
    jaws_touch: list[int]
    """Indices of the accepted parts that the jaws would touch: among all detections of the picture by score, or, of a
    tracked part, in the list of its frame."""
    record: dict[str, Any] = field(repr=False)
    """The record of `sdg detect --json`, with all digits; it lacks only `advice`, which names options of the program."""

    @classmethod
    def of(cls, record: dict[str, Any]) -> "Detection":
        """The detection of a record."""
        return cls(**_fields(record))


@dataclass(frozen=True)
class TrackedPart(Detection):
    """A tracked part."""

    track: int
    """Number of the track; it is kept while the part is tracked, and when it is found again."""
    state: str
    """"followed", "found_again" or "lost"."""
    age_s: float
    """Seconds since it was first found."""

    @classmethod
    def of(cls, record: dict[str, Any]) -> "TrackedPart":
        """The tracked part of a record."""
        return cls(**_fields(record), track=record["track"], state=record["state"], age_s=record["age_s"])


def _fields(record: dict[str, Any]) -> dict[str, Any]:
    pose = record.get("pose")
    return {
        "score": record["score"],
        "grasp": Grasp(**record["grasp"]),
        "pose": pose and Pose(**{**pose, "p_m": tuple(pose["p_m"])}),
        "evidence": record.get("evidence", {}),
        "refused": record.get("refused"),
        "box": tuple(record["box"]),
        "polygon": [(x, y) for x, y in record.get("polygon", [])],
        "jaws_touch": record.get("jaws_touch", []),
        "record": record,
    }


class Detections(list[Detection]):
    """The accepted detections of a picture, best score first."""

    refused: list[Detection]
    """The other detections, with a score below `min_score`, best first."""

    def __init__(self, found: list[Detection], min_score: float) -> None:
        super().__init__(one for one in found if one.score >= min_score)
        self._min_score = min_score
        self.refused = [one for one in found if one.score < min_score]

    @property
    def best(self) -> Detection:
        """The best accepted detection.

        Raises NothingToGrasp if there is none.
        """
        if self:
            return self[0]
        text = "expected a part to grasp, found nothing that resembles it"
        if self.refused:
            first = self.refused[0]
            text = f"expected a part to grasp, found none: the best place scores {first.score:.2f}"
            if first.refused:
                text += f": {first.refused}"
            else:
                text = (
                    f"expected a part to grasp with a score of at least {self._min_score:g} (min_score), "
                    f"found {first.score:.4f} at most"
                )
        raise NothingToGrasp(text)
