"""What is found in a picture, under the names of `sdg detect --json`."""

from dataclasses import dataclass, field
from typing import Any, Optional

from ._errors import NothingToGrasp


@dataclass(frozen=True)
class Grasp:
    """Where the gripper closes, in pixels of the picture: x right, y down, the middle of the first pixel at (0.5, 0.5)."""

    x: float
    y: float
    angle_deg: float
    """Direction from the first mark to the second, in (-180, 180], y down; the jaws close across it."""
    width_px: float
    """The part's width between the jaws."""


@dataclass(frozen=True)
class Pose:
    """Where the gripper closes, in metres and degrees of the camera's frame."""

    frame: str
    """"table" or "base", as the camera's file says."""
    p_m: tuple[float, float, float]
    yaw_deg: float
    """Turn about the frame's z, right-handed."""
    opening_m: float
    sigma_mm: float
    """The position lies within this with a probability of 68 %."""
    sigma_deg: float


@dataclass(frozen=True)
class Detection:
    """A place where the part may lie."""

    score: float
    """From 0 to 1, calibrated: from 0.5 on it is accepted."""
    grasp: Grasp
    pose: Optional[Pose]
    """None without a camera."""
    evidence: dict[str, float]
    """What the score is made of, in log-odds."""
    refused: Optional[str]
    """What speaks against it; None where it is accepted."""
    box: tuple[float, float, float, float]
    """Left, upper, right and lower edge, in pixels."""
    polygon: list[tuple[float, float]]
    """The outline's corners, in pixels."""
    record: dict[str, Any] = field(repr=False)
    """All of it as `sdg detect --json` has it, with every digit."""

    @classmethod
    def of(cls, record: dict[str, Any]) -> "Detection":
        """The detection of a record."""
        return cls(**_fields(record))


@dataclass(frozen=True)
class TrackedPart(Detection):
    """A part that is followed."""

    track: int
    """Stays the same while the part is followed, and when it is found again."""
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
        "record": record,
    }


class Detections(list[Detection]):
    """The accepted detections of a picture, best score first."""

    refused: list[Detection]
    """Those that score less, best first, each with what speaks against it."""

    def __init__(self, found: list[Detection], min_score: float) -> None:
        super().__init__(one for one in found if one.score >= min_score)
        self.refused = [one for one in found if one.score < min_score]

    @property
    def best(self) -> Detection:
        """The best one.

        Raises NothingToGrasp where there is none.
        """
        if self:
            return self[0]
        text = "expected a part to grasp, found nothing that resembles it"
        if self.refused:
            first = self.refused[0]
            text = f"expected a part to grasp, found none: the best place scores {first.score:.2f}"
            if first.refused:
                text += f": {first.refused}"
        raise NothingToGrasp(text)
