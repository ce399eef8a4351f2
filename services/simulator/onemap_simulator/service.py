"""The simulator service: a robot in real time.

Physics, commands and odometry run in the service's loop. Rendering runs in a
thread that always takes the newest pose: slow rendering lowers the frame rate
and never delays the reaction to a command.
"""

from __future__ import annotations

import hashlib
import logging
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

from onemap_shared.command_gate import CommandGate
from onemap_shared.geometry import F64
from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD, ROBOT_TRUTH
from onemap_shared.messages import Odometry, RgbdFrame, Truth, TruthRequest, VelocityCommand
from onemap_shared.rates import RateMeter
from onemap_shared.runner import StartError
from onemap_shared.transport import Bus, Health
from onemap_simulator.config import ODOMETRY_HZ, SimulatorConfig
from onemap_simulator.errors import FrameLink
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_simulator.parts import RobotParts, scene_truth
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import RgbdCamera, SceneRenderer
from onemap_simulator.scene.loading import load_scene
from onemap_simulator.scene.scene import Scene
from onemap_simulator.scene.scene_file import SUFFIXES, check_file

LOG = logging.getLogger("onemap.simulator")

APARTMENT = "apartment"  # the scene that is generated; any other is a path

PHYSICS_S = 0.02  # longest time between two steps of the physics
WAIT_S = 0.2  # period at which the camera's thread checks whether to stop


@dataclass(frozen=True, slots=True)
class StampedPose:
    """True and reported T_map_body (4, 4) at an instant, and where people are then."""

    stamp_ns: int
    T_true: F64
    T_reported: F64
    people: Bystanders = NOBODY


class CameraThread:
    """Renders an image from the newest pose offered and publishes what came over the link."""

    def __init__(
        self, bus: Bus, camera: RgbdCamera, link: FrameLink[RgbdFrame], world: str
    ) -> None:
        self._camera, self._link, self._world = camera, link, world
        self._clock = bus.clock
        self._publisher = bus.publish(ROBOT_RGBD)
        self._offered: StampedPose | None = None
        self._changed, self._stop = bus.clock.condition(), bus.clock.event()
        self._skipped = 0
        self._rate = RateMeter()
        self._render_ms = 0.0
        self._captured = 0
        self.sequence = 0  # frames published
        self._thread = bus.clock.thread("camera", self._run)

    def offer(self, pose: StampedPose) -> None:
        """Capture from this pose, unless a newer one is offered before the camera is free."""
        with self._changed:
            self._skipped += self._offered is not None
            self._offered = pose
            self._changed.notify()

    def metrics(self, now_s: float) -> dict[str, float]:
        """Mean frames_per_s of the last seconds, render_ms of the newest frame, counts."""
        return {
            "frames_per_s": self._rate.rate_hz(now_s),
            "render_ms": self._render_ms,
            "frames_skipped": self._skipped,
            "frames_lost": self._link.lost,
        }

    def close(self) -> None:
        """Finish the current image and stop the thread."""
        self._stop.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while not self._stop.is_set():
            if (pose := self._next()) is not None:
                self._capture(pose)
            for frame in self._link.arrived(self._clock.monotonic_s()):
                self._publisher.put(frame)
                self.sequence += 1
                self._rate = self._rate.with_event(self._clock.monotonic_s())

    def _next(self) -> StampedPose | None:
        with self._changed:
            if self._offered is None:
                self._changed.wait(self._patience_s())
            pose, self._offered = self._offered, None
            return pose

    def _patience_s(self) -> float:
        """Seconds to wait for a pose: until the next frame arrives, or WAIT_S."""
        arrival_s = self._link.next_s()
        if arrival_s is None:
            return WAIT_S
        return min(max(arrival_s - self._clock.monotonic_s(), 0.0), WAIT_S)

    def _capture(self, pose: StampedPose) -> None:
        began_s = self._clock.monotonic_s()
        image = self._camera.capture(pose.T_true, pose.people)
        self._render_ms = (self._clock.monotonic_s() - began_s) * 1e3
        frame = RgbdFrame(
            self._captured,
            pose.stamp_ns,
            image.rgb,
            image.depth_mm,
            self._camera.intrinsics,
            pose.T_reported @ self._camera.T_body_camera,
            self._world,
        )
        self._captured += 1
        self._link.send(frame, self._clock.monotonic_s())


class SimulatorWorker:
    """Steps the physics, publishes odometry, offers poses to the camera.

    parts: its robot; pose: the newest that it has told.
    """

    def __init__(
        self,
        bus: Bus,
        scene: Scene,
        config: SimulatorConfig,
        renderer: SceneRenderer | None = None,
    ) -> None:
        self._config, self._clock = config, bus.clock
        now_s = self._clock.monotonic_s()
        self.parts = parts = RobotParts.of(scene, config, renderer or Renderer(scene), now_s=now_s)
        self._localisation, self._simulation = parts.localisation, parts.simulation
        self._commands = bus.subscribe(ROBOT_CMD_VEL)
        self._gate = CommandGate(bus.instance)
        self._odometry = bus.publish(ROBOT_ODOMETRY)
        self._camera = CameraThread(bus, parts.camera, parts.link, world_of(scene))
        bus.serve(ROBOT_TRUTH, partial(self._truth_reply, scene_truth(scene, config)))
        self._sequence = 0
        self._collided = False
        self._odometry_due_s = self._rgbd_due_s = now_s
        self.pose = self._stamped_pose()

    def step(self, timeout_s: float) -> None:
        """Wait for a command for at most one step of the physics, then simulate up to now."""
        command = self._commands.take(min(timeout_s, PHYSICS_S))
        now_s = self._clock.monotonic_s()
        self._collided = self._simulation.advance(now_s) or self._collided
        if command is not None:
            self._obey(command, now_s)
        odometry_due, rgbd_due = now_s >= self._odometry_due_s, now_s >= self._rgbd_due_s
        if not (odometry_due or rgbd_due):
            return
        self.pose = pose = self._stamped_pose()
        if odometry_due:
            self._odometry_due_s = _next(self._odometry_due_s, ODOMETRY_HZ, now_s)
            self._publish_odometry(pose, now_s)
        if rgbd_due:
            self._rgbd_due_s = _next(self._rgbd_due_s, self._config.rgbd_hz, now_s)
            self._camera.offer(pose)

    def _obey(self, command: VelocityCommand, now_s: float) -> None:
        self._gate, allowed = self._gate.receive(command, now_s, self._clock.wall_ns())
        if allowed is not None:
            self._simulation.receive_command(allowed.velocity, now_s, allowed.validity_ms / 1e3)

    def health(self) -> Health:
        """Ready once the first image was published."""
        now_s, ready = self._clock.monotonic_s(), self._camera.sequence > 0
        return Health(
            ready=ready,
            problem=self._simulation.lag_problem(now_s) if ready else "it renders its first image",
            metrics={
                **self._camera.metrics(now_s),
                **asdict(self._simulation.counts),
                "commands_refused": self._commands.counters.refused,
                "commands_late": self._gate.late,
                "commands_foreign": self._gate.foreign,
                "commands_disordered": self._gate.disordered,
                "largest_pose_error_m": self._localisation.largest_error_m,
                "pose_jumps": self._localisation.jumps,
            },
        )

    def close(self) -> None:
        """Stop the camera's thread."""
        self._camera.close()

    def _stamped_pose(self) -> StampedPose:
        pose, people = self._simulation.state.pose, self._simulation.bystanders
        return StampedPose(self._clock.wall_ns(), pose, self._localisation.reported(pose), people)

    def _truth_reply(self, truth: SceneTruth, request: TruthRequest) -> Truth:
        """The reply for a place that searches name in the reported frame."""
        x_m, y_m = self._localisation.true_place(request.x_m, request.y_m)
        return truth.reply(TruthRequest(request.name, x_m, y_m))

    def _publish_odometry(self, pose: StampedPose, now_s: float) -> None:
        velocity = self._simulation.state.velocity
        planner, command_sequence = self._gate.echo(now_s)
        self._odometry.put(
            Odometry(
                self._sequence,
                pose.stamp_ns,
                pose.T_reported,
                velocity.linear_mps,
                velocity.angular_radps,
                collided=self._collided,
                planner=planner,
                command_sequence=command_sequence,
                lateral_mps=velocity.lateral_mps,
                driver=self._gate.driver,
            )
        )
        self._sequence += 1
        self._collided = False


def world_of(scene: Scene) -> str:
    """A name for a scene's world: another one for other geometry."""
    geometry = hashlib.sha256(scene.vertices.tobytes() + scene.faces.tobytes()).hexdigest()
    return f"{''.join(filter(str.isprintable, scene.name))[:40]} {geometry[:12]}"


def _next(due_s: float, rate_hz: float, now_s: float) -> float:
    """The next time of a periodic task; periods missed in a stall are skipped."""
    following = due_s + 1.0 / rate_hz
    return following if following > now_s else now_s + 1.0 / rate_hz


def open_scene(config: SimulatorConfig) -> Scene:
    """Generate the apartment of the seed and style, or read the scene's file; else ValueError."""
    check_scene(config.scene)
    if config.scene == APARTMENT:
        scene = generate_apartment(config.seed, STYLES[config.style])
    else:
        scene = load_scene(Path(config.scene))
        if config.start is None:
            yaml = Path(config.scene).with_suffix(".yaml").name
            _check_start(scene, config, f"the start of scene {config.scene} (set by {yaml})")
    if config.start is None:
        return scene
    scene = replace(scene, start=config.start)
    _check_start(scene, config, "simulator.start")
    return scene


def _check_start(scene: Scene, config: SimulatorConfig, what: str) -> None:
    (x, y, _), robot = scene.start, config.robot
    clearance_m = CollisionMap.of(scene, robot.height_m).clearance_m(x, y)
    if clearance_m < robot.radius_m:
        raise ValueError(
            f"{what} ({x:g}, {y:g}) is {clearance_m:.2f} m from an obstacle or outside of it; the "
            f"robot needs {robot.radius_m:g} m: choose a place on its free floor"
        )


def check_scene(name: str) -> None:
    """Raise ValueError with one sentence if there is no such scene, without opening it."""
    if name == APARTMENT:
        return
    if not Path(name).suffix:
        raise ValueError(
            f"scene {name!r} is unknown: write {APARTMENT!r} or the path of a file "
            f"({', '.join(SUFFIXES)})"
        )
    check_file(Path(name))


def check(config: SimulatorConfig) -> None:
    """Raise StartError if there is no scene to open; fast, and without the bus."""
    try:
        check_scene(config.scene)
    except ValueError as problem:
        raise StartError(str(problem)) from problem


def build(bus: Bus, config: SimulatorConfig) -> SimulatorWorker:
    """Open the scene and make the worker, or raise StartError."""
    try:
        scene = open_scene(config)
        for warning in scene.warnings:
            LOG.warning(warning)
        LOG.info("%s: %d triangles, %d objects", scene.name, len(scene.faces), len(scene.objects))
        return SimulatorWorker(bus, scene, config)
    except ValueError as problem:
        raise StartError(str(problem)) from problem
