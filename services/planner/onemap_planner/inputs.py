"""What the planner hears of the robot and the map, with the time of arrival."""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.staleness import (
    Arrival,
    InputAges,
    StalenessParams,
    ages,
    newest,
    stale_reason,
)
from onemap_shared.geometry import yaw_of
from onemap_shared.messages import MapRevision, Odometry

MAX_ODOMETRY_STEP_M = (
    1.0  # between two odometry messages: the robot was carried or restarted, not driven
)
MIN_SPEED_MPS = 0.005  # below this a changing pose is noise and no way


@dataclass(frozen=True, slots=True)
class LatestInputs:
    """The newest of each stream.

    collided_s: when a collision was last reported; odometer_m: way driven since the start;
    map_version: (revision, frames fused) of the newest map; maps: how many were heard of.
    """

    pose: Pose2d | None = None
    collided_s: float = float("-inf")
    odometer_m: float = 0.0
    odometry: Arrival | None = None
    revision: Arrival | None = None
    map_version: tuple[int, int] = (0, 0)
    map_count: int = 0

    def ages(self, now_s: float) -> InputAges:
        """How old it all is."""
        return ages(self.odometry, self.revision, now_s)

    def stale_reason(self, now_s: float, params: StalenessParams) -> str:
        """Why the robot must stand still; empty if it may move."""
        return stale_reason(self.ages(now_s), params)


def with_odometry(inputs: LatestInputs, message: Odometry, now_s: float) -> LatestInputs:
    """With the robot's new pose, and the odometer advanced by the way from the last."""
    T = message.T_map_body
    pose = Pose2d(float(T[0, 3]), float(T[1, 3]), yaw_of(T))
    moving = inputs.pose is not None and abs(message.linear_mps) > MIN_SPEED_MPS
    way_m = pose.distance_to(inputs.pose.xy) if inputs.pose is not None and moving else 0.0
    return replace(
        inputs,
        pose=pose,
        collided_s=now_s if message.collided else inputs.collided_s,
        odometer_m=inputs.odometer_m + (way_m if way_m < MAX_ODOMETRY_STEP_M else 0.0),
        odometry=newest(inputs.odometry, Arrival(message.sequence, message.stamp_ns, now_s)),
    )


def with_revision(inputs: LatestInputs, message: MapRevision, now_s: float) -> LatestInputs:
    """With the map's new revision.

    It is another map (cleared, loaded, or of a mapper that began anew) if it holds fewer frames
    than before, or more than it took revisions to fuse.
    """
    arrival = Arrival(message.revision, message.stamp_ns, now_s)
    revisions = message.revision - inputs.map_version[0]
    frames = message.frames_fused - inputs.map_version[1]
    another = inputs.revision is None or frames < 0 or frames > revisions
    return replace(
        inputs,
        revision=newest(inputs.revision, arrival),
        map_version=(message.revision, message.frames_fused),
        map_count=inputs.map_count + another,
    )
