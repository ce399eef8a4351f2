"""What the planner hears of the robot and the map, with the time of arrival."""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_planner.motion.pure_pursuit import Pose
from onemap_planner.motion.staleness import Ages, Arrival, FreshnessRules, ages, complaint, newest
from onemap_shared.geometry import yaw_of
from onemap_shared.messages import MapRevision, Odometry

JUMP_M = 1.0  # between two odometry messages: the robot was carried or restarted, not driven
STANDING_MPS = 0.005  # below this a changing pose is noise and no way


@dataclass(frozen=True, slots=True)
class Heard:
    """The newest of each stream.

    collided_s: when a collision was last reported; odometer_m: way driven since the start;
    map_changes: (revision, frames fused) of the newest map; maps: how many were heard of.
    """

    pose: Pose | None = None
    collided_s: float = float("-inf")
    odometer_m: float = 0.0
    odometry: Arrival | None = None
    revision: Arrival | None = None
    map_changes: tuple[int, int] = (0, 0)
    maps: int = 0

    def ages(self, now_s: float) -> Ages:
        """How old it all is."""
        return ages(self.odometry, self.revision, now_s)

    def complaint(self, now_s: float, rules: FreshnessRules) -> str:
        """Why the robot must stand still; empty if it may move."""
        return complaint(self.ages(now_s), rules)


def hear_odometry(heard: Heard, message: Odometry, now_s: float) -> Heard:
    """With the robot's new pose, and the odometer advanced by the way from the last."""
    T = message.T_map_body
    pose = Pose(float(T[0, 3]), float(T[1, 3]), yaw_of(T))
    moving = heard.pose is not None and abs(message.linear_mps) > STANDING_MPS
    way_m = pose.distance_to(heard.pose.xy) if heard.pose is not None and moving else 0.0
    return replace(
        heard,
        pose=pose,
        collided_s=now_s if message.collided else heard.collided_s,
        odometer_m=heard.odometer_m + (way_m if way_m < JUMP_M else 0.0),
        odometry=newest(heard.odometry, Arrival(message.sequence, message.stamp_ns, now_s)),
    )


def hear_revision(heard: Heard, message: MapRevision, now_s: float) -> Heard:
    """With the map's new revision.

    It is another map (cleared, loaded, or of a mapper that began anew) if it holds fewer frames
    than before, or more than it took revisions to fuse.
    """
    arrival = Arrival(message.revision, message.stamp_ns, now_s)
    revisions = message.revision - heard.map_changes[0]
    frames = message.frames_fused - heard.map_changes[1]
    another = heard.revision is None or frames < 0 or frames > revisions
    return replace(
        heard,
        revision=newest(heard.revision, arrival),
        map_changes=(message.revision, message.frames_fused),
        maps=heard.maps + another,
    )
