"""Parameters of the search policy, and the parameters of all parts that it uses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import Field, PositiveFloat, PositiveInt

from onemap_planner.motion.progress import RecoveryParams
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.motion.staleness import StalenessParams
from onemap_planner.policy.dead_ends import DeadEndParams
from onemap_planner.policy.goals import GoalParams
from onemap_planner.policy.order_params import ObjectOrderParams
from onemap_planner.policy.place_params import PlaceParams
from onemap_planner.policy.viewpoints import Bands
from onemap_planner.world.candidates import AcceptanceParams, ConsensusParams
from onemap_planner.world.costmap import CostmapParams
from onemap_planner.world.frontiers import FrontierParams
from onemap_planner.world.regions import SimilarRegionParams
from onemap_shared.params import Params


class ExploreParams(Params):
    """Times and distances of the search itself. Seconds run only while inputs are fresh."""

    former_keys: ClassVar[Mapping[str, str]] = {"shun_m": "blacklist_radius_m"}

    approach_nearest_m: PositiveFloat = Field(
        default=0.7, description="Metres from the object's surface; nearer, it fills the image."
    )
    approach_farthest_m: PositiveFloat = Field(
        default=1.1, description="Metres from the object's surface at which it counts as reached."
    )
    approach_last_resort_m: PositiveFloat = Field(
        default=1.25,
        description="Metres tried when nothing nearer can be reached; success is 1.5 m (paper), "
        "and what the map takes for the surface may lie two cells before it.",
    )
    approach_limit_m: PositiveFloat = Field(
        default=1.5,
        description="Metres from which what detector and map agree on is confirmed if the robot "
        "fits nowhere nearer, as before a bathtub behind a washbasin: success (paper).",
    )
    camera_height_m: PositiveFloat = Field(
        default=1.0,
        description="Metres above the floor, as the simulator's: with the two angles, from how "
        "near an object of which height can be looked at.",
    )
    sees_down_deg: float = Field(
        default=43.0,
        gt=0,
        lt=90,
        description="Below the horizontal, how far the image reaches: half the vertical field of "
        "view, plus the pitch of the camera; the simulator's 63 degrees, pitched by 12.",
    )
    sees_up_deg: float = Field(
        default=20.0, gt=0, lt=90, description="Above it: half of that, less the pitch."
    )
    confirm_sightings: PositiveInt = Field(
        default=6,
        description="Agreeing detections while standing before it: a third of the frames. What "
        "the detector takes for the object from afar flickers when seen from near.",
    )
    confirm_s: PositiveFloat = Field(
        default=5.0,
        description="Seconds to wait for them: 20 frames at the slowest useful rate of 4 Hz.",
    )
    linger_s: PositiveFloat = Field(
        default=1.0,
        description="Seconds at a goal, so that the map fuses it; it is blacklisted afterwards.",
    )
    settle_s: PositiveFloat = Field(
        default=2.0,
        description="Seconds without any goal before the robot looks around for one; without one "
        "after that the object counts as not found.",
    )
    goal_base_s: PositiveFloat = Field(
        default=15.0, description="Seconds allowed for any goal, turning included."
    )
    goal_s_per_m: PositiveFloat = Field(
        default=5.0, description="Seconds allowed per metre of path: three times a slow drive."
    )
    blacklist_radius_m: PositiveFloat = Field(
        default=0.5,
        description="Metres around a goal viewed without result in which no other is taken.",
    )
    known_around: float = Field(
        default=0.4,
        ge=0,
        le=1,
        description="Known part of the 1 m circle below which the robot first looks around: one "
        "view shows 22 percent, in a corner 45 percent can be known.",
    )
    cut_off_m2: PositiveFloat = Field(
        default=2.0,
        description="Square metres of free floor that no path leads to, from which on all "
        "frontiers are visited once more before the object counts as not found: a small room.",
    )
    object_limit_s: PositiveFloat = Field(
        default=600.0, description="Seconds per object; a flat of 100 m2 takes about 200."
    )
    patience_s: PositiveFloat = Field(
        default=30.0, description="Seconds with stale or missing inputs before the search fails."
    )

    @property
    def bands_m(self) -> Bands:
        """Nearest and farthest distance from the object's surface, then those of last resort."""
        nearest_m, farthest_m = self.approach_nearest_m, self.approach_farthest_m
        distances_m = (nearest_m, farthest_m), (nearest_m, self.approach_last_resort_m)
        return Bands(
            distances_m,
            self.approach_limit_m,
            self.camera_height_m,
            self.sees_down_deg,
            self.sees_up_deg,
        )


class PlannerParams(Params):
    """All parameters of a planning step, one group for each subject."""

    former_keys: ClassVar[Mapping[str, str]] = {"terrain": "costmap", "freshness": "staleness"}

    costmap: CostmapParams = Field(
        default=CostmapParams(),
        description="Where the robot may drive: its size, in metres, against the map.",
    )
    frontier: FrontierParams = Field(
        default=FrontierParams(),
        description="What counts as a border of the explored that is worth a visit.",
    )
    region: SimilarRegionParams = Field(
        default=SimilarRegionParams(),
        description="What counts as a region of the map that is worth a closer view.",
    )
    goal: GoalParams = Field(
        default=GoalParams(),
        description="How goals are weighed against each other and the path to them.",
    )
    consensus: ConsensusParams = Field(
        default=ConsensusParams(),
        description="When a detection and the map agree, so that it counts.",
    )
    acceptance: AcceptanceParams = Field(
        default=AcceptanceParams(),
        description="When a thing is the object although the map does not agree: rates of errors, "
        "by which many near views from several sides outweigh it.",
    )
    explore: ExploreParams = Field(
        default=ExploreParams(),
        description="Times in seconds and distances in metres of the search itself.",
    )
    dead_end: DeadEndParams = Field(
        default=DeadEndParams(),
        description="When goals that were given up are offered again, in metres.",
    )
    order: ObjectOrderParams = Field(
        default=ObjectOrderParams(),
        description="How the cheapest order of objects is estimated, in metres of way.",
    )
    place: PlaceParams = Field(
        default=PlaceParams(),
        description="When a place counts as reached, or as seen, in metres.",
    )
    drive: DriveParams = Field(
        default=DriveParams(),
        description="Speeds, accelerations and tolerances of driving along a path.",
    )
    staleness: StalenessParams = Field(
        default=StalenessParams(),
        description="How old, in seconds, the inputs may be: older ones stop the robot.",
    )
    recovery: RecoveryParams = Field(
        default=RecoveryParams(),
        description="What to do when the robot does not move as it should.",
    )
