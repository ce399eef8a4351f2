"""Parameters of a planning step, one group for each subject."""

from __future__ import annotations

from pydantic import Field, PositiveFloat

from onemap_planner.motion.progress import RecoveryParams
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.motion.staleness import StalenessParams
from onemap_planner.world.costmap import CostmapParams
from onemap_shared.params import Params


class ExploreParams(Params):
    """How near a robot goes to what it finds, and how long it searches for one object."""

    approach_farthest_m: float = Field(
        default=1.1,
        ge=0.8,
        le=1.25,
        description="Metres from the object's surface at which it counts as reached.",
    )
    object_limit_s: PositiveFloat = Field(
        default=600.0, description="Seconds per object; a flat of 100 m2 takes about 200."
    )


class PlannerParams(Params):
    """All parameters of a planning step, one group for each subject."""

    costmap: CostmapParams = Field(
        default=CostmapParams(), description="The robot's size, in metres, against the map."
    )
    explore: ExploreParams = Field(
        default=ExploreParams(), description="The end of the way to an object, and its time."
    )
    drive: DriveParams = Field(
        default=DriveParams(), description="Speeds and accelerations of driving along a path."
    )
    staleness: StalenessParams = Field(
        default=StalenessParams(),
        description="How old, in seconds, the inputs may be: older ones stop the robot.",
    )
    recovery: RecoveryParams = Field(
        default=RecoveryParams(), description="When the robot counts as stuck."
    )
