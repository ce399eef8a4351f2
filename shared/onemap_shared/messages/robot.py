"""Messages of a robot and of every process.

RGB-D frames, odometry, corrected poses, velocity commands; heartbeats and receipts; ground truth.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import U8, U16, Velocity2d
from onemap_shared.messages.checks import Finite, Message, Name, Pose, Shape, numbers, within

# Milliseconds that a velocity command holds at most: every driver brakes by itself after them, and
# the planner checks each command to their end.
COMMAND_VALIDITY_MS = 300


@dataclass(frozen=True, slots=True)
class RgbdFrame(Message):
    """One aligned colour and depth image with the camera's pose at capture.

    Attributes:
        rgb: (H, W, 3) red, green, blue; row 0 is the top of the image.
        depth_mm: (H, W) depth along the optical axis in millimetres, 0 = no return.
        world: a name for what the poses are in, another one for another place or frame of
            reference: a map is never continued in another world. Empty: a robot with one only.
    """

    sequence: int
    stamp_ns: int
    rgb: Annotated[U8, Shape("H", "W", 3)]
    depth_mm: Annotated[U16, Shape("H", "W")]
    intrinsics: Intrinsics
    T_map_camera: Pose
    world: Name = ""

    def _check(self) -> None:
        if self.depth_mm.size == 0:
            raise ValueError("the image has no pixels")
        self.intrinsics.check_image(self.depth_mm.shape[1], self.depth_mm.shape[0])


@dataclass(frozen=True, slots=True)
class Odometry(Message):
    """Where the robot's body is and how fast it moves (body frame: x forward, z up).

    Attributes:
        sequence: counts these messages; frames have a count of their own.
        stamp_ns: time of the pose, in nanoseconds of the robot's wall clock.
        T_map_body: (4, 4) rigid transform from the body frame to the map frame.
        linear_mps: speed forwards, in metres per second.
        angular_radps: turning speed, in radians per second, positive to the left.
        collided: whether an obstacle stopped the robot since the previous message.
        planner: the instance of the planner whose commands the robot follows; empty while it
            follows none.
        command_sequence: of the newest command that came from it, followed or not; 0 before the
            first; -1: the driver does not say, and the planner cannot measure its loop.
        lateral_mps: speed to the left, in metres per second; 0 for a differential drive.
        reached: x, y in metres and yaw in radians of the last goal that the robot's own navigation
            says it has reached, while it stands there; empty without one.
        hold: why the planner must wait: the robot may not do what it is told; empty if it does.
        refused: x, y and yaw of a goal at which the robot's own navigation failed twice in a row,
            as long as it got no other one; empty without one.
        driver: the instance of the process that drives the robot, as it joined the bus: a search
            ends with the driver that it was accepted for; empty: it does not say.
    """

    sequence: int
    stamp_ns: int
    T_map_body: Pose
    linear_mps: Finite
    angular_radps: Finite
    collided: bool = False
    planner: Name = ""
    command_sequence: int = -1
    lateral_mps: Finite = 0.0
    reached: Annotated[tuple[float, ...], numbers(3, optional=True)] = ()
    hold: str = ""
    driver: Name = ""
    refused: Annotated[tuple[float, ...], numbers(3, optional=True)] = ()


@dataclass(frozen=True, slots=True)
class VelocityCommand(Message):
    """Drive with this velocity for at most ``validity_ms`` after it arrived, then brake.

    The planner has checked it for so long, and not longer: close to obstacles it is shorter.

    Attributes:
        sequence: counts the commands of this planner, from 1.
        stamp_ns: when the command was made, on the planner's wall clock.
        linear_mps: speed forwards, in metres per second; negative backwards.
        angular_radps: turning speed, in radians per second, positive to the left.
        validity_ms: milliseconds after its arrival for which the command holds.
        planner: the instance of the planner that sends it; empty: it does not say.
        odometry_stamp_ns: the stamp of the newest odometry that the planner had, by which the
            robot tells on its own clock how old the command is; 0: the planner does not say.
        frame_ns: capture time of the newest frame in the map on which its plan rests; 0: it rests
            on none, as a stop on stale inputs, or until a plan knows another map or other places.
        lateral_mps: speed to the left, in metres per second; 0 unless the planner is set to a
            holonomic robot.
        driver: the instance of the driver that it is for, as that one's odometry names it: another
            one does not obey; empty: the driver does not say.
    """

    sequence: int
    stamp_ns: int
    linear_mps: Finite
    angular_radps: Finite
    validity_ms: Annotated[int, within(0, COMMAND_VALIDITY_MS)] = COMMAND_VALIDITY_MS
    planner: Name = ""
    odometry_stamp_ns: int = 0
    frame_ns: int = 0
    lateral_mps: Finite = 0.0
    driver: Name = ""

    @property
    def velocity(self) -> Velocity2d:
        """The velocity in the body frame."""
        return Velocity2d(self.linear_mps, self.angular_radps, self.lateral_mps)

    @property
    def moves(self) -> bool:
        """Whether it is not a stop."""
        return self.velocity != Velocity2d()


START_METRIC = "start_s"  # seconds that the start has taken so far; absent once it is over


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """One a second from every service.

    Attributes:
        service: its name, as in the key.
        instance: which process of that service.
        stamp_ns: when it was sent, in nanoseconds of that machine's wall clock.
        progress: a count that stops when the service's loop hangs.
        ready: whether the service does its work.
        problem: one sentence if something is wrong, else empty.
        metrics: name to number, shown at /metrics as onemap_<service>_<name>.
        version: of OneMap that the process runs; empty for a driver without it.
    """

    service: str
    instance: str
    stamp_ns: int
    progress: int
    ready: bool
    problem: str = ""
    metrics: dict[str, float] = field(default_factory=dict)
    version: str = ""

    @property
    def starting(self) -> bool:
        """Whether the service's start goes on: it is waited for as long as that takes."""
        return START_METRIC in self.metrics


@dataclass(frozen=True, slots=True)
class FrameReceipt:
    """A stage took this frame and begins to work on it: its sender may send another.

    Attributes:
        sequence: of the frame.
        stamp_ns: of the frame.
    """

    sequence: int
    stamp_ns: int


@dataclass(frozen=True, slots=True)
class TruthRequest:
    """Simulator only: request for the true distance of a point to the nearest such object.

    Attributes:
        name: category of the object; empty: only what the scene has is asked.
        x_m: of the point, in the map frame.
        y_m: of the point, in the map frame.
    """

    name: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class Truth:
    """Ground truth for the summary of a demo; never read by perception, mapper or planner.

    Attributes:
        scene: name of the scene.
        instances: number of such objects.
        distance_m: straight line from the point to the surface of the nearest; infinity if there
            is none.
        shortest_path_m: along the floor for this robot to the nearest point that counts as
            success, 0 if the point itself does; infinity if there is none.
        categories: every category of the scene.
        nearest: category of the object nearest to the point, without walls, floors, ceilings,
            doors and windows; empty if there is none or it has no name.
        names_complete: whether every object of the scene has a name. If not, an object whose
            name is not among the categories may still be there, and a search for it cannot be
            evaluated.
    """

    scene: str
    instances: int
    distance_m: float
    shortest_path_m: float
    categories: tuple[str, ...]
    nearest: str
    names_complete: bool
