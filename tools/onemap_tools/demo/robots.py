"""The simulated robots of a demo: their names, addresses and shares of the configuration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import atan2
from typing import Any

import numpy as np

from onemap_simulator.config import SimulatorConfig
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.scene import Scene
from onemap_simulator.service import open_scene
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

SITE = "demo"  # of the robots' namespaces
MAX_ROBOTS = 4
SHARED_RGBD_HZ = 4.0  # of each of several: what a search needs, half of one robot's alone


@dataclass(frozen=True, slots=True)
class DemoRobot:
    """A robot of the demo. path: of its addresses at the gateway. process: that simulates it.

    A robot that is alone has neither name nor namespace.
    """

    name: str
    namespace: str
    path: str
    process: str

    @property
    def prefix(self) -> str:
        """What the names of its own processes and files begin with."""
        return f"{self.name}-" if self.name else ""


def named_robots(count: int, process: str) -> tuple[DemoRobot, ...]:
    """So many robots, each simulated by a process of this name; one alone needs no name."""
    if count == 1:
        return (DemoRobot("", "", "", process),)
    names = [f"r{number}" for number in range(1, count + 1)]
    return tuple(DemoRobot(name, f"{SITE}/{name}", f"/robots/{name}", process) for name in names)


def check_combination(robots: int, *, objects: Sequence[str], ros2: bool) -> None:
    """CliError if so many robots cannot be simulated, or not with these options."""
    if not 1 <= robots <= MAX_ROBOTS:
        raise CliError(
            f"--robots is {robots}, and the demo simulates 1 to {MAX_ROBOTS}: give another number.",
            EXIT_USAGE_ERROR,
        )
    if robots == 1:
        return
    for given, option, why in (
        (ros2, "--ros2", "behind ROS 2's formats there is one simulated robot"),
        (
            0 < len(objects) < robots,
            "--objects",
            "each robot takes one object after the other, and one would have none",
        ),
    ):
        if given:
            raise CliError(
                f"{option} does not fit --robots {robots}: {why}.",
                EXIT_USAGE_ERROR,
            )


def sections_of_robots(
    sections: Mapping[str, Any], robots: Sequence[DemoRobot]
) -> tuple[dict[str, Any], ...]:
    """The configuration of each robot's processes, made of that of one robot alone.

    The first robot's is also that of mapper, gateway and router. The section ``simulator`` must be
    valid. CliError if the scene has no room
    for so many robots.
    """
    if len(robots) == 1:
        return (dict(sections),)
    config = SimulatorConfig.model_validate(sections["simulator"])
    try:
        scene = open_scene(config)
        starts = (scene.start, *further_starts(scene, config.robot, len(robots) - 1))
    except ValueError as problem:
        raise CliError(
            f"--robots {len(robots)} cannot start: {problem}.", EXIT_USAGE_ERROR
        ) from problem
    served = {robot.name: robot.namespace for robot in robots}
    shared = with_values(
        {**sections, "simulator": {"rgbd_hz": SHARED_RGBD_HZ, **sections["simulator"]}},
        {"gateway": {"robots": served}, "mapper": {"robots": list(served.values())}},
    )
    state = sections["planner"]["state_dir"]
    return tuple(
        with_values(
            shared,
            {
                "bus": {"namespace": robot.namespace},
                "simulator": {"start": [round(value, 3) for value in start]},
                "planner": {"state_dir": f"{state}/{robot.name}"},
            },
        )
        for robot, start in zip(robots, starts, strict=True)
    )


def with_values(
    sections: Mapping[str, Any], values: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    """The sections with these values in place of their own."""
    return {
        **sections,
        **{name: {**sections.get(name, {}), **part} for name, part in values.items()},
    }


Start = tuple[float, float, float]  # x, y in metres and yaw in radians, in the scene's frame

CELL_SIZE_M = 0.05
ROOMY_M = 0.3  # between the body and obstacles, where the floor has it
MARGIN_M = 0.1  # the same where it has not: a robot can turn and leave
MIN_APART_M = 1.0  # between the middles of two robots


def further_starts(scene: Scene, robot: RobotParams, count: int) -> tuple[Start, ...]:
    """Starts of ``count`` robots beside the one at the scene's start, which they face.

    Each is as far from those before as the floor reaches. ValueError if it does not hold so many
    robots ``MIN_APART_M`` apart.
    """
    collision = CollisionMap.of(scene, robot.height_m, CELL_SIZE_M)
    x_m, y_m, _ = scene.start
    reachable = collision.reachable_cells(x_m, y_m, robot.radius_m)
    starts: list[Start] = []
    for margin_m in (ROOMY_M, MARGIN_M):
        wide = reachable & (collision.clearance >= robot.radius_m + margin_m)
        places = collision.grid.centres(np.argwhere(wide))
        away = np.linalg.norm(places - (x_m, y_m), axis=1)
        starts = []
        while len(starts) < count and len(places) and away.max() >= MIN_APART_M:
            x, y = (float(value) for value in places[int(away.argmax())])
            starts.append((x, y, atan2(y_m - y, x_m - x)))
            away = np.minimum(away, np.linalg.norm(places - (x, y), axis=1))
        if len(starts) == count:
            return tuple(starts)
    raise ValueError(
        f"{scene.name} has room for {len(starts) + 1} robots that start {MIN_APART_M:g} m apart, "
        f"not for {count + 1}"
    )
