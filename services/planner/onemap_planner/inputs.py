"""Latest inputs from robot and map, with their times of arrival."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from onemap_planner.motion.collision_monitor import USUAL_DELIVERY_S
from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.staleness import (
    Arrival,
    InputAges,
    LoopMonitor,
    OdometryDelay,
    SentCommand,
    StalenessParams,
    ages,
    newest,
    stale_reason,
)
from onemap_planner.motion.velocity_controller import ControllerInputs
from onemap_planner.policy.context import USUAL_CAMERA
from onemap_planner.sentences import waiting_for
from onemap_shared.geometry import yaw_of
from onemap_shared.messages import CameraView, Heartbeat, MapRevision, Odometry
from onemap_shared.rates import RateMeter
from onemap_shared.services import DRIVER, doubled, doubled_sentence, role_of

# A longer step between two messages was not driven: the robot was carried, or its pose corrected.
JUMP_M, JUMP_MPS, JUMP_S = 0.3, 1.0, 1.0  # 0.3 m, and 1 m/s since the last message, 1 s at most
# Metres from where the odometer last counted, at which a robot that tells no speed has driven: the
# pose of one that stands is within a tenth of that.
COUNTED_M = 0.2
STAGES = ("perception", "mapper")  # starts that a search waits for; no robot drives off at boot
# A stage that starts says so once a second, or later: an import may keep its interpreter.
START_TOLD_S = 10.0
USUAL_LOOP_S = 0.1  # of a command on one computer: in USUAL_DELIVERY_S, with one control period
MIN_SPEED_MPS = 0.005  # below this a changing pose is noise, not driving


@dataclass(frozen=True, slots=True)
class DriverLife:
    """Which process drives the robot, and how many have so far: a search ends with its driver.

    count: of different ones, 0 before the first. named: by its odometry, empty if it does not say;
    member: as it joined the bus, empty if it did not; sequence: of its newest odometry, which
    another process counts anew.
    """

    count: int = 0
    named: str = ""
    member: str = ""
    sequence: int = -1

    def with_odometry(self, message: Odometry) -> DriverLife:
        """After odometry arrived: it names another driver, or counts anew."""
        same = message.driver == self.named and message.sequence >= self.sequence
        count = self.count if same and self.count else self.count + 1
        return DriverLife(count, message.driver, self.member, message.sequence)

    def with_members(self, drivers: frozenset[str]) -> DriverLife:
        """With the instances of all drivers on the bus; one that only lost the router is no other.

        Two at a time are none, since nobody can tell which one drives.
        """
        if len(drivers) != 1 or self.member in drivers:
            return self
        (member,) = drivers
        if self.member == "" or member == self.named:
            return replace(self, member=member)
        named = member if self.named else ""
        return DriverLife(self.count + 1, named, member)


@dataclass(frozen=True, slots=True)
class LatestInputs:
    """The newest message of each stream. Times are seconds of the planner's monotonic clock.

    collided_s: when a collision was last reported; odometer_m: distance driven since the start, up
    to counted_xy, metres; map_rate: of new frames in the map; map_id and map_version: of the newest
    map, the latter (revision, frames fused); map_count: different maps so far; places_version and
    objects_version: that count, and the version of this map's places and finds; exchange_count: of
    these, those that took the place of another in a running mapper; stages: the processes of
    perception and mapper, and stages_at_s when they last changed; start: what one of them says
    about its start, and start_at_s when; jump_count: how often the robot was found beside where it
    was, by its pose or by what the map sees; loop and delay: how long commands and odometry travel;
    mixed: why messages of several robots or mappers come, empty if they do not; driver: who drives
    the robot; camera: of the robot, and offset_m, see ``MapRevision``, as the mapper last told
    them; reached and hold: what the robot's own navigation says, see ``Odometry``.
    """

    pose: Pose2d | None = None
    reached: Pose2d | None = None
    refused: Pose2d | None = None
    hold: str = ""
    collided_s: float = float("-inf")
    odometer_m: float = 0.0
    counted_xy: tuple[float, float] | None = None
    odometry: Arrival | None = None
    revision: Arrival | None = None
    map_id: str = ""
    map_version: tuple[int, int] = (0, 0)
    map_count: int = 0
    exchange_count: int = 0
    jump_count: int = 0
    places_version: tuple[int, int] = (0, 0)
    objects_version: tuple[int, int] = (0, 0)
    map_rate: RateMeter = field(default_factory=RateMeter)
    loop: LoopMonitor = field(default_factory=LoopMonitor)
    delay: OdometryDelay = field(default_factory=OdometryDelay)
    mixed: str = ""
    driver: DriverLife = DriverLife()
    stages: frozenset[tuple[str, str]] = frozenset()
    stages_at_s: float = float("-inf")
    start: str = ""
    start_at_s: float = float("-inf")
    camera: CameraView = USUAL_CAMERA
    offset_m: float = 0.0

    def ages(self, now_s: float, frame_ns: int = 0) -> InputAges:
        """Ages of odometry and map at ``now_s``; frame_ns: of the view that is planned on."""
        rate_hz = 0.0
        if self.revision is not None:  # at the last frame: a pause makes the map old, not slow
            rate_hz = self.map_rate.rate_hz(self.revision.at_s)
        period_s = 1.0 / rate_hz if rate_hz > 0 else math.inf
        return ages(self.odometry, self.revision, now_s, period_s, frame_ns)

    def stale_reason(self, now_s: float, params: StalenessParams, frame_ns: int = 0) -> str:
        """Why the robot must stop; empty if it may move. frame_ns: see ``ages``."""
        stale = stale_reason(self.ages(now_s, frame_ns), params)
        stale = stale and (self.starts(now_s) or stale)
        return self.mixed or self.hold or stale or self._late_reason(now_s, params)

    def patience_from_s(self, now_s: float) -> float:
        """Since when a map can be expected: it was heard once, and no stage said it starts."""
        return now_s if self.revision is None else max(self.stages_at_s, self.start_at_s)

    def starts(self, now_s: float) -> str:
        """What a stage says about its start, as long as that goes on; empty if none starts."""
        return self.start if now_s - self.start_at_s <= START_TOLD_S else ""

    def for_controller(
        self, search_id: str, now_s: float, params: StalenessParams, frame_ns: int = 0
    ) -> ControllerInputs:
        """What the velocity controller needs at ``now_s``; the id is empty without a search.

        frame_ns: of the plan that it follows.
        """
        return ControllerInputs(
            now_s=now_s,
            search_id=search_id,
            pose=self.pose and self.loop.predicted(self.pose, now_s, USUAL_LOOP_S),
            stale_reason=self.stale_reason(now_s, params, frame_ns),
            map_age_s=self.ages(now_s, frame_ns).map_content_s,
            confirmed=self.loop.confirmed(now_s),
            loop_s=self.loop.loop_s(now_s),
            delivery_s=USUAL_DELIVERY_S + 2 * self.delay.excess_s,
            places_version=self.places_version,
        )

    def _late_reason(self, now_s: float, params: StalenessParams) -> str:
        looped = self.loop.problem(now_s, params.max_loop_s) if self.loop.named else ""
        return looped or self.delay.problem(params.max_odometry_delay_s)


def with_odometry(inputs: LatestInputs, message: Odometry, now_s: float) -> LatestInputs:
    """The inputs with the new pose, and the odometer advanced by the distance driven."""
    T = message.T_map_body
    pose = Pose2d(float(T[0, 3]), float(T[1, 3]), yaw_of(T))
    inputs = _with_way(inputs, pose, math.hypot(message.linear_mps, message.lateral_mps), now_s)
    return replace(
        inputs,
        pose=pose,
        reached=Pose2d(*message.reached) if message.reached else None,
        refused=Pose2d(*message.refused) if message.refused else None,
        hold=message.hold,
        collided_s=now_s if message.collided else inputs.collided_s,
        odometry=newest(inputs.odometry, Arrival(message.sequence, message.stamp_ns, now_s)),
        loop=inputs.loop.with_odometry(message, now_s),
        driver=inputs.driver.with_odometry(message),
        delay=inputs.delay.with_odometry(message.stamp_ns, now_s),
    )


def _with_way(inputs: LatestInputs, pose: Pose2d, speed_mps: float, now_s: float) -> LatestInputs:
    """The inputs with the way to this pose: each step of a robot that says that it moves.

    One that says it stands may not tell its speed: then its way counts in chords of ``COUNTED_M``.
    """
    if inputs.pose is None or inputs.counted_xy is None or inputs.odometry is None:
        return replace(inputs, counted_xy=pose.xy)
    since_s = min(now_s - inputs.odometry.at_s, JUMP_S)
    if pose.distance_to(inputs.pose.xy) > JUMP_M + JUMP_MPS * since_s:
        return replace(inputs, counted_xy=pose.xy, jump_count=inputs.jump_count + 1)
    way_m = pose.distance_to(inputs.counted_xy)
    if speed_mps <= MIN_SPEED_MPS and way_m < COUNTED_M:
        return inputs
    return replace(inputs, odometer_m=inputs.odometer_m + way_m, counted_xy=pose.xy)


def with_start(inputs: LatestInputs, beat: Heartbeat, now_s: float) -> LatestInputs:
    """The inputs with what a stage says about its start, which goes on."""
    return replace(inputs, start=waiting_for(f"the {beat.service}", beat.problem), start_at_s=now_s)


def with_members(
    inputs: LatestInputs, members: frozenset[tuple[str, str]], now_s: float
) -> LatestInputs:
    """The inputs with the processes on the bus, service and instance of each."""
    stages = frozenset(each for each in members if each[0] in STAGES)
    if stages != inputs.stages:
        inputs = replace(inputs, stages=stages, stages_at_s=now_s)
    twice = doubled(members)
    roles = [role for role in (DRIVER, "mapper") if role in twice]
    mixed = "; ".join(doubled_sentence(role, twice[role]) for role in roles)
    drivers = frozenset(instance for service, instance in members if role_of(service) == DRIVER)
    driver = inputs.driver.with_members(drivers)
    if (mixed, driver) == (inputs.mixed, inputs.driver):
        return inputs
    return replace(inputs, mixed=mixed, driver=driver)


def with_sent(inputs: LatestInputs, command: SentCommand) -> LatestInputs:
    """The inputs after a command was sent: the loop is measured from then on."""
    return replace(inputs, loop=inputs.loop.with_sent(command))


def with_revision(inputs: LatestInputs, message: MapRevision, now_s: float) -> LatestInputs:
    """The inputs with the new revision of the map, which is fresh if it holds a new frame.

    It is another map (cleared, loaded, or of a restarted mapper) if its id says so; where a mapper
    of an earlier release says none, if it holds fewer frames than before, or gained more frames
    than revisions. A restarted mapper counts revisions anew; its found objects and their frame are
    those of before, unlike after clear and load.
    """
    # A new frame has a new stamp; the revision changes also when a layer is reset.
    arrival = newest(inputs.revision, Arrival(message.stamp_ns, message.stamp_ns, now_s))
    fresh = arrival is not inputs.revision
    revisions = message.revision - inputs.map_version[0]
    frames = message.frames_fused - inputs.map_version[1]
    another = message.map_id != inputs.map_id
    beside = message.offset_m > 0.0 and inputs.offset_m == 0.0
    if not message.map_id:
        another = inputs.revision is None or frames < 0 or frames > revisions
    exchanged = (
        another and revisions > 0 and inputs.map_count > 0
    )  # the first takes no other's place
    return replace(
        inputs,
        revision=arrival,
        map_rate=inputs.map_rate.with_event(now_s) if fresh else inputs.map_rate,
        map_id=message.map_id,
        map_version=(message.revision, message.frames_fused),
        map_count=inputs.map_count + another,
        places_version=(inputs.map_count + another, message.places_version),
        objects_version=(inputs.map_count + another, message.objects_version),
        exchange_count=inputs.exchange_count + exchanged,
        camera=message.camera[0] if message.camera else inputs.camera,
        offset_m=message.offset_m,
        jump_count=inputs.jump_count + beside,
    )
