"""The demo with nav2 at its stock tolerances: ``python -m tests.ros2.nav2_demo FORM FIRST [...]``.

FORM: rmw, bridge or old_bridge, what the robot speaks. FIRST: robot or adapter, which of them is
there before the other one. Further arguments go to ``onemap demo --ros2``. The robot is the
simulator's, behind the tests' own writing of the formats; its nav2 drives it, by goals alone. The
last line of output is JSON: what was found, and how many goals it took.
"""

from __future__ import annotations

import json
import os
import runpy
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import yaml

from onemap_planner.motion.motions import Pose2d
from onemap_ros2.cdr import decode
from onemap_ros2.network.interface import RosNetwork
from onemap_shared.config import PREFIX
from onemap_shared.geometry import Velocity2d
from onemap_shared.runner import ServiceParts, run_service
from onemap_shared.transport import Bus
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.service import SimulatorWorker, check, open_scene
from onemap_tools.demo import setup
from onemap_tools.demo.ros2_robot import ROUTER_VARIABLE, Ros2Robot
from onemap_tools.processes.launch import ProcessSpec, onemap_command
from tests.ros2.fake_nav2 import ACTION, FakeNav2
from tests.ros2.fake_network import FakeReader
from tests.ros2.fake_robot import FORMS, FakeBridge, FakeRobot, Publisher
from tests.ros2.stock_nav2 import EXECUTING, StockNav2
from tests.structure import ROOT

MIDDLEWARE = {"rmw": "rmw_zenoh"}  # the others are zenoh-bridge-ros2dds
FORM, FIRST = "NAV2_DEMO_FORM", "NAV2_DEMO_FIRST"
WAIT_S = 0.1
VALID_S = 0.5  # of a velocity of nav2's controller
CELL_M = 0.05


class FormNetwork:
    """What the simulated robot needs of a network, in one of the forms."""

    def __init__(self, robot: FakeRobot | FakeBridge) -> None:
        self._robot = robot
        self._came = threading.Event()
        self._written: list[Publisher] = []  # which a latched topic needs as long as it lasts

    def write(self, topic: str, ros_type: str, *, latched: bool = False) -> Any:
        self._written.append(self._robot.publish(topic, ros_type, latched=latched))
        return self._written[-1]

    def read(self, topic: str, ros_type: str, depth: int) -> FakeReader:
        assert depth > 0
        reader = FakeReader()

        def hear(data: bytes) -> None:
            reader.waiting.append(data)
            self._came.set()

        self._robot.subscribe(topic, ros_type, hear)
        return reader

    def wait(self, timeout_s: float) -> None:
        self._came.wait(timeout_s)
        self._came.clear()

    def close(self) -> None:
        self._robot.session.close()


class Nav2Server(FakeNav2):
    """The action, with ``StockNav2`` behind it."""

    def __init__(self, robot: FakeRobot | FakeBridge, nav2: StockNav2) -> None:
        self._nav2, self._lock = nav2, threading.Lock()
        super().__init__(robot, "wait")

    def step(self, here: Pose2d) -> Velocity2d | None:
        """The velocity now; None while there is no goal."""
        with self._lock:
            velocity = self._nav2.step(here)
            active = EXECUTING in self._nav2.states.values()
            for goal_id, state in self._nav2.states.items():
                if state != EXECUTING and not self._ends[goal_id].is_set():
                    self._states[goal_id] = state
                    self._ends[goal_id].set()
        return velocity if active else None

    def _goal(self, request: bytes) -> bytes:
        pose = decode(request, f"{ACTION}_SendGoal_Request").goal.pose.pose
        yaw_rad = 2 * float(np.arctan2(pose.orientation.z, pose.orientation.w))
        reply = super()._goal(request)
        with self._lock:
            self._nav2.goal(request[4:20], Pose2d(pose.position.x, pose.position.y, yaw_rad))
            self._say("counts", len(self._nav2.states), self._nav2.repeated)
        return reply

    def _cancel(self, request: bytes) -> bytes:
        with self._lock:
            self._nav2.cancel(request[4:20])
        return super()._cancel(request)


class Nav2Robot(Ros2Robot):
    """The simulated robot; what its nav2 wants comes beside what the command topic says."""

    def __init__(self, bus: Bus, config: SimulatorConfig) -> None:
        robot = FORMS[os.environ[FORM]](os.environ[ROUTER_VARIABLE])
        super().__init__(bus, cast(RosNetwork, FormNetwork(robot)), config)
        scene = open_scene(config)
        floor = CollisionMap.of(scene, config.robot.height_m, CELL_M)
        clearance_m = np.asarray(floor.clearance, np.float64)
        self._nav2 = Nav2Server(robot, StockNav2(floor.grid, clearance_m, config.robot.radius_m))

    def step(self, timeout_s: float) -> None:
        state, now_s = self._simulation.state, time.monotonic()
        velocity = self._nav2.step(Pose2d(state.x_m, state.y_m, state.yaw_rad))
        if velocity is not None:
            self._simulation.receive_command(velocity, now_s, VALID_S)
        super().step(timeout_s)


def up_file(arguments: list[str]) -> Path:
    """A file beside the configuration that is there as soon as the robot is."""
    return Path(arguments[arguments.index("--config") + 1]).with_name("robot.up")


def build(bus: Bus, config: SimulatorConfig) -> SimulatorWorker:
    """The robot; after the adapter, if that is to be there first."""
    while os.environ[FIRST] == "adapter" and "ros2" not in bus.alive():
        time.sleep(WAIT_S)
    made = Nav2Robot(bus, config)
    up_file(sys.argv).touch()
    return made


def start_adapter(arguments: list[str]) -> None:
    """Become the adapter; after the robot, if that is to be there first."""
    while os.environ[FIRST] == "robot" and not up_file(arguments).exists():
        time.sleep(WAIT_S)
    os.execv(sys.executable, onemap_command("ros2", *arguments))


def run_demo(form: str, first: str, arguments: list[str]) -> int:
    """Run the demo; its exit code."""
    preset = yaml.safe_load((ROOT / "deploy/config/robots/nav2.yaml").read_text(encoding="utf-8"))
    for key, value in preset["planner"].items():
        os.environ[f"{PREFIX}PLANNER__{key.upper()}"] = json.dumps(value)
    os.environ[f"{PREFIX}ROS2__MIDDLEWARE"] = MIDDLEWARE.get(form, "zenoh-bridge-ros2dds")
    os.environ[f"{PREFIX}ROS2__DRIVE"] = "nav2"
    os.environ[FORM], os.environ[FIRST] = form, first
    folders = []
    processes = setup._processes

    def with_nav2(robots: Any, files: Any, process: str) -> tuple[ProcessSpec, ...]:
        folders.append(files[0].parent)
        here = (sys.executable, "-m", "tests.ros2.nav2_demo")
        given = ("--config", str(files[0]))
        commands = {setup.ROS2_ROBOT: (*here, "--robot", *given), "ros2": (*here, "ros2", *given)}
        made = processes(robots, files, process)
        return tuple(replace(s, command=commands.get(s.name, s.command)) for s in made)

    setup._processes = with_nav2
    sys.argv = ["onemap", "demo", "--ros2", "--headless", *arguments]
    try:
        runpy.run_module("onemap_tools", run_name="__main__")
    except SystemExit as end:
        code = int(end.code or 0)
    log = (folders[0] / "logs" / f"{setup.ROS2_ROBOT}.log").read_text("utf-8")
    said = [json.loads(line)[1:] for line in log.splitlines() if line.startswith('["nav2"')]
    _, goals, repeated = next((e for e in reversed(said) if e[0] == "counts"), ("", 0, 0))
    ends = [each[2] for each in said if each[0] == "end"]
    counts = {f"status_{state}": ends.count(state) for state in sorted(set(ends))}
    told = {"form": form, "first": first, "exit": code, "goals": goals, "repeated": repeated}
    print(json.dumps({**told, **counts}))
    return code


def main(arguments: list[str]) -> int:
    """One of the processes of the demo, or all of it."""
    match arguments:
        case ["ros2", *given]:
            start_adapter(given)
        case ["--robot", *given]:
            sys.argv = ["robot", *given]
            parts = ServiceParts(SimulatorConfig, build, check, section="simulator")
            run_service(setup.ROS2_ROBOT, lambda _: parts)
        case [form, ("robot" | "adapter") as first, *given] if form in FORMS:
            return run_demo(form, first, given)
    print(__doc__)
    return 2


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
