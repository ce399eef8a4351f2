"""What a step sees, and what it decides."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_planner.motion.motions import Motion, Pose2d, Rest
from onemap_planner.policy.context import USUAL_CAMERA
from onemap_planner.policy.goals import NO_AREAS, Goal, SearchAreas
from onemap_planner.policy.state import PlannerState
from onemap_planner.search.state_machine import Event, EventStamp
from onemap_planner.world.costmap import Costmap
from onemap_planner.world.map_view import PlanningView
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import CameraView, Detections, KeptObject, MapPlaces, ObjectFind
from onemap_shared.places import NOWHERE

STAND = Rest()


@dataclass(frozen=True, slots=True)
class Observation:
    """Inputs of one planning step, at ``now_s`` of the planner's monotonic clock.

    pose None: no odometry yet; pose_ns: its time on the robot's clock, 0 if unknown; view None: the
    map has not answered; detections: all since the last step, oldest first; command: the velocity
    that the plan last asked for; stale_reason: why the inputs are too old to act on, empty if they
    are fresh; blocked: the costmap did not allow the command, so that the robot stands;
    creeps: it allowed only the speed over floor that no camera saw; patience_from_s: before then
    nobody could expect fresh inputs, because a stage was starting; camera: of the robot; reached:
    the goal at which its own navigation says it stands, refused: the one at which that failed
    twice, None without one; places: of the map; finds: that it keeps;
    anchor_views: of the anchors of the object's description; offset_m: how far beside the map the
    newest frame stands, see ``MapRevision``.
    """

    now_s: float
    pose: Pose2d | None
    odometer_m: float
    command: Velocity2d
    collided: bool
    view: PlanningView | None
    detections: tuple[Detections, ...]
    stale_reason: str
    blocked: bool = False
    creeps: bool = False
    patience_from_s: float = float("-inf")
    camera: CameraView = USUAL_CAMERA
    reached: Pose2d | None = None
    refused: Pose2d | None = None
    anchor_views: tuple[PlanningView, ...] = ()
    places: MapPlaces = NOWHERE
    finds: tuple[KeptObject, ...] = ()
    offset_m: float = 0.0
    pose_ns: int = 0

    def stamp(self, active_time_s: float) -> EventStamp:
        """When and where it was made; active_time_s: of the search."""
        xy = self.pose.xy if self.pose else None
        return EventStamp(self.now_s, active_time_s, xy, self.odometer_m)


@dataclass(frozen=True, slots=True)
class Move:
    """What a phase of the search decides: the motion, and what has happened.

    areas: that the map offered, beside candidates.
    """

    motion: Motion = STAND
    event: Event | None = None
    areas: SearchAreas = NO_AREAS


@dataclass(frozen=True, slots=True)
class Decision:
    """The motion until the next step, with the goal and the areas that the map offered.

    finds: objects that this step confirmed, for the map to keep.
    """

    motion: Motion
    costmap: Costmap
    goal: Goal | None
    areas: SearchAreas
    finds: tuple[ObjectFind, ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """The state after a step, and what to do; nothing while inputs are stale or missing."""

    state: PlannerState
    decision: Decision | None = None
