"""Errors of a real robot: odometry that drifts, loop closures, late frames, poor depth, people.

``ERRORS`` names the combinations that can be simulated; the numbers stand for a small robot with
wheels and a stereo camera at home.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

import numpy as np

from onemap_shared.geometry import F64, inverse, pose_2d, transform, wrap_angle, yaw_of

Item = TypeVar("Item")
ErrorChoice = Literal["none", "drift", "jump", "late", "dropped", "depth", "people", "all"]

KEPT_EVERY_M = 0.05  # between two poses of the history
LEAST_SHARE = 0.25  # of the largest bias: every run drifts
# The pose jumps back to the true one, as after a correction of SLAM, near an earlier place:
CLOSING_RADIUS_M = 1.0
CLOSING_WAY_M = 8.0  # since that place and the last closure: a loop, not a turn in a room
PLACE_EVERY_M = 0.25  # of way between two places that are remembered
SAME_VIEW_RAD = np.pi / 4  # two views overlap by half at a field of view of 79 degrees
LOST_IN_A_ROW = 4.0  # mean number of frames: networks lose in bursts (Gilbert, 1960)
EDGE_JUMP = 0.1  # change of depth, over the depth, from which on it is an edge


@dataclass(frozen=True, slots=True)
class DriftParams:
    """Drift of the reported pose with the way; the sign of each bias is drawn per run."""

    way_percent: float = 2.0  # largest error of lengths: good visual or wheel odometry
    yaw_deg_per_m: float = 0.5  # largest error of the heading: wheels without a gyroscope
    # Standard deviation of the random part after 1 m, over the largest bias; it grows with the
    # square root of the way.
    random_walk: float = 0.5


@dataclass(frozen=True, slots=True)
class FrameLinkParams:
    """Delays and losses of frames; stamps and poses stay those of the capture."""

    min_delay_s: float = 0.0
    max_delay_s: float = 0.0  # each frame's delay is drawn evenly between both
    lost_share: float = 0.0  # of the frames, in [0, 1)


@dataclass(frozen=True, slots=True)
class DepthErrorParams:
    """What a stereo camera does; shares in [0, 1], all off by default."""

    noise_m: float = 0.0  # standard deviation at 1 m, growing with the square of distance
    # Between two values at 1 m, growing with the square of distance (Khoshelham and Elberink 2012).
    step_m: float = 0.0
    edge_flying: float = 0.0  # of the pixels at edges: anywhere between front and back
    edge_holes: float = 0.0  # of the pixels at edges: no return, as one of two views misses them
    dark_below: float = 0.0  # mean colour of a texture below which its surface gives no return
    glass: bool = False  # windows and mirrors give no return


@dataclass(frozen=True, slots=True)
class RobotErrors:
    """All errors of one robot; None and the defaults: none."""

    drift: DriftParams | None = None
    loop_closure: bool = False  # the drifting pose jumps back to the true one
    link: FrameLinkParams = FrameLinkParams()
    depth: DepthErrorParams = DepthErrorParams()
    people: int = 0  # who walk about


# Steps as a Kinect's: 7 cm at 5 m. Black lacquer and leather absorb the projected infrared.
STEREO = DepthErrorParams(
    noise_m=0.002, step_m=0.0028, edge_flying=0.3, edge_holes=0.3, dark_below=25.0, glass=True
)
ERRORS: Mapping[ErrorChoice, RobotErrors] = {
    "none": RobotErrors(),
    "drift": RobotErrors(drift=DriftParams()),
    "jump": RobotErrors(drift=DriftParams(), loop_closure=True),
    # Compressed images over a busy wireless network.
    "late": RobotErrors(link=FrameLinkParams(min_delay_s=0.1, max_delay_s=0.6)),
    "dropped": RobotErrors(link=FrameLinkParams(lost_share=0.2)),
    "depth": RobotErrors(depth=STEREO),
    "people": RobotErrors(people=2),
    "all": RobotErrors(
        drift=DriftParams(),
        loop_closure=True,
        link=FrameLinkParams(min_delay_s=0.1, max_delay_s=0.6, lost_share=0.2),
        depth=STEREO,
        people=2,
    ),
}


class Localisation:
    """Reports poses with errors, for true poses in the order of time.

    It keeps which true pose each report stands for, so that a place that was told in the reported
    frame can be judged by the ground truth.
    """

    def __init__(self, errors: RobotErrors, rng: np.random.Generator) -> None:
        self._drift = None if errors.drift is None else DriftingOdometry(errors.drift, rng)
        self._closures = LoopClosures() if errors.loop_closure else None
        self._history: list[tuple[F64, F64]] = []  # reported, true T_map_body
        self.largest_error_m = 0.0

    @property
    def jumps(self) -> int:
        """Loop closures so far."""
        return self._closures.count if self._closures else 0

    def reported(self, T_true: F64) -> F64:
        """The reported T_map_body (4, 4) at the next true one."""
        if self._drift is None:
            return T_true
        T_reported = self._drift.reported(T_true)
        if self._closures is not None and self._closures.closes(T_true):
            self._drift.correct(T_true)
            T_reported = T_true
        error_m = float(np.linalg.norm(T_reported[:2, 3] - T_true[:2, 3]))
        self.largest_error_m = max(self.largest_error_m, error_m)
        last_xy = self._history[-1][0][:2, 3] if self._history else np.inf
        if np.hypot(*(T_reported[:2, 3] - last_xy)) >= KEPT_EVERY_M:
            self._history.append((T_reported, T_true))
        return T_reported

    def true_place(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Where a place of the reported frame truly is, seen from the latest reported pose near it.

        The same place without drift.
        """
        if not self._history:
            return x_m, y_m
        reported_xy = np.array([reported[:2, 3] for reported, _ in self._history])
        away = np.hypot(*(reported_xy - (x_m, y_m)).T)
        near = np.flatnonzero(away <= away.min() + KEPT_EVERY_M)
        T_reported, T_true = self._history[int(near[-1])]
        return true_place(T_reported, T_true, (x_m, y_m))


def true_place(T_reported: F64, T_true: F64, place: tuple[float, ...]) -> tuple[float, float]:
    """Where a place (x, y) of the reported frame truly is, for a robot at these T_map_body."""
    moved = transform(T_true @ inverse(T_reported), np.array([place[0], place[1], 0.0]))
    return float(moved[0]), float(moved[1])


class DriftingOdometry:
    """Integrates the true motion with errors; exact at the first pose and after ``correct``."""

    def __init__(self, params: DriftParams, rng: np.random.Generator) -> None:
        largest = np.array([params.way_percent / 100, np.radians(params.yaw_deg_per_m)])
        self._bias: F64 = largest * rng.uniform(LEAST_SHARE, 1.0, 2) * rng.choice((-1.0, 1.0), 2)
        self._walk: F64 = largest * params.random_walk
        self._rng = rng
        self._T_true: F64 | None = None
        self._T_reported: F64 = np.eye(4)

    def reported(self, T_true: F64) -> F64:
        """The reported T_map_body (4, 4) at the next true one."""
        if self._T_true is None:
            self.correct(T_true)
        else:
            moved = inverse(self._T_true) @ T_true
            self._T_reported = self._T_reported @ self._measured(moved)
            self._T_true = T_true
        return self._T_reported

    def correct(self, T_true: F64) -> None:
        """Set the reported pose to the true one (4, 4)."""
        self._T_true = self._T_reported = T_true

    def _measured(self, moved: F64) -> F64:
        """A small motion (4, 4) of the body as odometry measures it."""
        dx_m, dy_m = float(moved[0, 3]), float(moved[1, 3])
        way_m = float(np.hypot(dx_m, dy_m))
        if way_m == 0:
            return moved  # no way, no error: turning on the spot is measured exactly
        errors = self._bias * way_m + self._walk * np.sqrt(way_m) * self._rng.standard_normal(2)
        scale = 1.0 + float(errors[0]) / way_m
        return pose_2d(dx_m * scale, dy_m * scale, yaw_of(moved) + float(errors[1]))


class LoopClosures:
    """Recognises earlier places along the true way."""

    def __init__(self) -> None:
        self._way_m = 0.0
        self._closed_m = 0.0
        self._last_xy: F64 | None = None
        self._places: list[tuple[float, float, float, float]] = []  # way, x, y, yaw
        self.count = 0

    def closes(self, T_true: F64) -> bool:
        """Whether a loop closes at the next true T_map_body (4, 4)."""
        xy, yaw_rad = T_true[:2, 3], yaw_of(T_true)
        if self._last_xy is not None:
            self._way_m += float(np.linalg.norm(xy - self._last_xy))
        self._last_xy = xy
        closed = self._way_m - self._closed_m >= CLOSING_WAY_M and self._knows(xy, yaw_rad)
        if closed:
            self._closed_m = self._way_m
            self.count += 1
        if not self._places or self._way_m - self._places[-1][0] >= PLACE_EVERY_M:
            self._places.append((self._way_m, float(xy[0]), float(xy[1]), yaw_rad))
        return closed

    def _knows(self, xy: F64, yaw_rad: float) -> bool:
        return any(
            self._way_m - way_m >= CLOSING_WAY_M
            and np.hypot(x - xy[0], y - xy[1]) <= CLOSING_RADIUS_M
            and abs(wrap_angle(yaw - yaw_rad)) <= SAME_VIEW_RAD
            for way_m, x, y, yaw in self._places
        )


class FrameLink(Generic[Item]):
    """Delivers what is sent in its order, late, with losses."""

    def __init__(self, params: FrameLinkParams, rng: np.random.Generator) -> None:
        self._params, self._rng = params, rng
        self._under_way: deque[tuple[float, Item]] = deque()  # when it arrives, what
        self._losing = False
        self.lost = 0

    def send(self, item: Item, now_s: float) -> None:
        """Send a frame that was captured now, in seconds of any monotonic clock."""
        if self._loses():
            self.lost += 1
            return
        params = self._params
        low_s, high_s = sorted((params.min_delay_s, params.max_delay_s))
        delay_s = float(self._rng.uniform(low_s, high_s)) if high_s > 0 else 0.0
        before_s = self._under_way[-1][0] if self._under_way else now_s
        self._under_way.append((max(before_s, now_s + delay_s), item))

    def arrived(self, now_s: float) -> list[Item]:
        """The frames that arrived since the last call, oldest first."""
        items = []
        while self._under_way and self._under_way[0][0] <= now_s:
            items.append(self._under_way.popleft()[1])
        return items

    def next_s(self) -> float | None:
        """When the next frame arrives; None if none is under way."""
        return self._under_way[0][0] if self._under_way else None

    def _loses(self) -> bool:
        """Whether the next frame is lost: a chain of two states, losing and not."""
        lost_share = self._params.lost_share
        if lost_share == 0:
            return False
        ends = 1.0 / LOST_IN_A_ROW
        begins = min(ends * lost_share / (1.0 - lost_share), 1.0)
        chance = self._rng.random()
        self._losing = chance >= ends if self._losing else chance < begins
        return self._losing
