"""What is kept of an episode: one JSON object per episode."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

from onemap_tools.demo.summary import json_value

TRAJECTORY_DIGITS = 2  # centimetres


class Failure(str, Enum):
    """Why an object was not found; the first that applies."""

    NONE = ""
    WRONG_OBJECT = "wrong object claimed"
    STOPPED_SHORT = "stopped out of reach or sight"
    STUCK = "the search failed"
    NEVER_IN_VIEW = "never in view"
    NOT_DETECTED = "in view, not detected"
    NOT_ACCEPTED = "detected, not accepted"


@dataclass(frozen=True, slots=True)
class ObjectRecord:
    """The search for one object. Lengths in metres: driven, shortest, and along the floor from
    where it stopped to the nearest success place; None where there is no path.

    in_view, detected: frames that showed it large enough, and in which it was detected.
    """

    name: str
    outcome: str
    reason: str
    success: bool
    claimed_wrongly: bool
    spl: float
    path_length_m: float
    shortest_path_m: float | None
    goal_distance_m: float | None
    time_s: float
    in_view: int
    detected: int
    failure: Failure
    timed_out: bool = False


@dataclass(frozen=True, slots=True)
class EpisodeRecord:
    """One episode. start: x, y, yaw; trajectory: true positions in metres, one per frame;
    contacts: above 0.05 m/s, counted by the simulator, people_touched of them with people;
    pose_error_m: the largest of the reported pose; wall_s is the only value that differs between
    two runs; scene: where it ran, empty for the apartment of the seed; stairwells: x_min, y_min,
    x_max, y_max in metres of openings in the floor, edges_crossed: how often the robot came over
    one."""

    index: int
    seed: int
    start: tuple[float, float, float]
    objects: tuple[ObjectRecord, ...]
    contacts: int
    simulated_s: float
    trajectory: tuple[tuple[float, float], ...]
    wall_s: float
    scene: str = ""
    people_touched: int = 0
    frames_lost: int = 0
    pose_jumps: int = 0
    pose_error_m: float = 0.0
    stairwells: tuple[tuple[float, float, float, float], ...] = ()
    edges_crossed: int = 0

    @property
    def progress(self) -> int:
        """Objects found before the first that was not."""
        done = 0
        for item in self.objects:
            if not item.success:
                break
            done += 1
        return done

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        fields = asdict(self)
        fields["objects"] = [
            {**{key: json_value(value) for key, value in item.items()}, "failure": kept.failure}
            for item, kept in zip(fields["objects"], self.objects, strict=True)
        ]
        fields["trajectory"] = [
            [round(x, TRAJECTORY_DIGITS), round(y, TRAJECTORY_DIGITS)] for x, y in self.trajectory
        ]
        return {name: json_value(value) for name, value in fields.items()}


def episode_record(document: dict[str, Any]) -> EpisodeRecord:
    """The record of a JSON object; raises ValueError, KeyError or TypeError if it is not one."""
    objects = tuple(
        ObjectRecord(**{**item, "failure": Failure(item["failure"])})
        for item in document["objects"]
    )
    x, y, yaw = document["start"]
    trajectory = tuple((float(a), float(b)) for a, b in document["trajectory"])
    known = {"objects": objects, "start": (x, y, yaw), "trajectory": trajectory}
    stairwells = tuple(tuple(map(float, corners)) for corners in document.get("stairwells", ()))
    return EpisodeRecord(**{**document, **known, "stairwells": stairwells})
