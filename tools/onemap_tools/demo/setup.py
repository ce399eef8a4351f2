"""Prepares a demo run: its robots, configuration files, processes and objects to search for."""

from __future__ import annotations

import os
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import atan2
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rich.console import Console

from onemap_shared.config import PREFIX, read
from onemap_shared.sentence import listed_sentences
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.scene import STRUCTURE, UNNAMED, Scene
from onemap_simulator.service import APARTMENT, open_scene
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra
from onemap_tools.processes.launch import ProcessSpec, make_folder, onemap_command
from onemap_tools.processes.network import DEFAULT_PORT, LOOPBACK, any_free_port, next_free_port
from onemap_tools.processes.services import CORE, check_robot

# The processes in place of the robot.
SIMULATOR, ROS2_ROBOT = "simulator", "ros2_robot"
SITE = "demo"  # of the robots' namespaces
MAX_ROBOTS = 4
OF_EACH_ROBOT = (SIMULATOR, "perception", "planner")  # the other services are shared
SHARED_RGBD_HZ = 4.0  # of each of several: what a search needs, half of one robot's alone
OBJECTS = 3
OBJECTS_EACH = 2  # of several robots

# Searched for by default where the scene has them: large objects of different rooms first.
PREFERRED_OBJECTS = (
    "bed",
    "television",
    "refrigerator",
    "toilet",
    "washing machine",
    "bathtub",
    "sofa",
    "bookcase",
    "desk",
)
# Categories that every room has: finding one demonstrates nothing.
UNINFORMATIVE = STRUCTURE | {"picture", "lamp"}

CELL_SIZE_M = 0.05
ROOMY_M = 0.3  # between the body and obstacles, where the floor has it
MARGIN_M = 0.1  # the same where it has not: a robot can turn and leave
MIN_APART_M = 1.0  # between the middles of two robots


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """The options of the command line. Without ``objects`` the demo chooses them.

    ``ros2``: the robot speaks ROS 2. ``robots``: how many, with one map.
    """

    seed: int
    scene: Path | None
    objects: tuple[str, ...]
    headless: bool
    port: int
    folder: Path
    time_limit_s: float
    ros2: bool = False
    robots: int = 1

    @property
    def process(self) -> str:
        """What runs in place of the robot."""
        return ROS2_ROBOT if self.ros2 else SIMULATOR


@dataclass(frozen=True, slots=True)
class DemoRobot:
    """A robot of the demo; process: that simulates it. One alone has no name."""

    name: str = ""
    process: str = SIMULATOR

    @property
    def namespace(self) -> str:
        return f"{SITE}/{self.name}" if self.name else ""

    @property
    def prefix(self) -> str:
        """What the names of its own processes and files begin with."""
        return f"{self.name}-" if self.name else ""


@dataclass(frozen=True, slots=True)
class DemoSetup:
    """Processes of a run, their environment, and the addresses to reach them.

    config_file: of the first robot, and of what the robots share. warnings: of the scene's file.
    """

    endpoint: str
    url: str
    config_file: Path
    specs: tuple[ProcessSpec, ...]
    environment: dict[str, str]
    robots: tuple[DemoRobot, ...]
    warnings: tuple[str, ...] = ()

    def url_of(self, robot: DemoRobot) -> str:
        """Where a robot's page and API are."""
        return f"{self.url}/robots/{robot.name}" if robot.name else self.url

    @property
    def pages(self) -> str:
        """Where the live page of each robot is, in words."""
        if len(self.robots) == 1:
            return f"Live page: {self.url}"
        pages = (f"{robot.name} {self.url_of(robot)}/" for robot in self.robots)
        return f"Live pages: {', '.join(pages)}"


def parse_objects(objects: str | None) -> tuple[str, ...]:
    """The names and sentences between commas; empty for None. CliError if there are none."""
    try:
        parts = listed_sentences(objects or "")
    except ValueError as problem:
        raise CliError(f"--objects: {problem}.", EXIT_USAGE_ERROR) from problem
    names = tuple(name for part in parts if (name := part.strip(" ,")))
    if objects is not None and not names:
        raise CliError(
            f"--objects is {objects!r}, which names nothing: write bed,television or leave it out",
            EXIT_USAGE_ERROR,
        )
    return names


def choose_port(wanted: int, *, headless: bool, console: Console) -> int:
    """A free port for the live page, from ``wanted`` upwards.

    0 stands for the default port, or for any free port if the run is headless.
    """
    if wanted == 0 and headless:
        return any_free_port()
    first = wanted or DEFAULT_PORT
    port = next_free_port(first)
    if port != first:
        console.print(f"Port {first} is taken; the live page is on {port}.")
    return port


def run_folder(parent: Path, now: datetime, seed: int) -> Path:
    """A path for the run's folder that does not exist yet."""
    name = f"{now:%Y%m%d-%H%M%S}-seed{seed}"
    candidates = [parent / name, *(parent / f"{name}-{n}" for n in range(2, 1000))]
    return next(folder for folder in candidates if not folder.exists())


def check_robots(robots: int, *, objects: Sequence[str], ros2: bool) -> None:
    """CliError if so many robots cannot be simulated, or not with these options."""
    problem = ""
    if not 1 <= robots <= MAX_ROBOTS:
        problem = (
            f"--robots is {robots}, and the demo simulates 1 to {MAX_ROBOTS}: give another number."
        )
    elif robots > 1 and ros2:
        problem = (
            f"--ros2 does not fit --robots {robots}: behind ROS 2's formats there is one "
            "simulated robot."
        )
    elif 0 < len(objects) < robots:
        problem = (
            f"--objects does not fit --robots {robots}: each robot takes one object after the "
            "other, and one would have none."
        )
    if problem:
        raise CliError(problem, EXIT_USAGE_ERROR)


def set_up(options: DemoOptions) -> DemoSetup:
    """Write the run's configuration and list the processes; CliError if it cannot work."""
    check_robots(options.robots, objects=options.objects, ros2=options.ros2)
    endpoint = f"tcp/{LOOPBACK}:{any_free_port()}"
    sections = demo_sections(os.environ, options, endpoint)
    # Overrides are in the file already; applied again they would replace fixed values.
    environment = {k: v for k, v in os.environ.items() if not k.startswith(PREFIX)}
    check_robot(SIMULATOR, sections)
    if options.ros2:
        from onemap_tools.demo.ros2_robot import ROUTER_VARIABLE

        check_robot("ros2", sections)
        environment[ROUTER_VARIABLE] = endpoint
    warnings = scene_warnings_of(sections)
    names = [f"r{n}" for n in range(1, options.robots + 1)] if options.robots > 1 else [""]
    robots = tuple(DemoRobot(name, options.process) for name in names)
    parts = sections_of_robots(sections, robots)
    make_folder(options.folder)
    files = [options.folder / f"{robot.prefix}config.yaml" for robot in robots]
    for file, part in zip(files, parts, strict=True):
        file.write_text(yaml.safe_dump(part, sort_keys=False), encoding="utf-8")
    return DemoSetup(
        endpoint=endpoint,
        url=f"http://{LOOPBACK}:{options.port}",
        config_file=files[0],
        specs=_processes(robots, files, options.process),
        environment=environment,
        robots=robots,
        warnings=warnings,
    )


def scene_warnings_of(sections: Mapping[str, Any]) -> tuple[str, ...]:
    """What may be wrong with the scene's file, in sentences; CliError for what is wrong."""
    config = SimulatorConfig.model_validate(sections["simulator"])
    try:
        return () if config.scene == APARTMENT else open_scene(config).warnings
    except ValueError as problem:
        raise CliError(f"{problem}.", EXIT_USAGE_ERROR) from problem


def demo_sections(
    environment: Mapping[str, str], options: DemoOptions, endpoint: str
) -> dict[str, Any]:
    """The demo's configuration: the environment, then the values of this run."""
    fixed: dict[str, dict[str, Any]] = {
        "bus": {"connect": [endpoint], "namespace": ""},
        "gateway": {"host": LOOPBACK, "port": options.port},
        "simulator": {"seed": options.seed},
        "mapper": {"map_folder": str(options.folder / "maps")},
        "planner": {"state_dir": str(options.folder / "planner")},
    }
    if options.scene is not None:
        fixed["simulator"]["scene"] = str(options.scene.resolve())
    if options.ros2:
        with requires_extra("ros2", "A demo with ROS 2"):
            from onemap_tools.demo.ros2_robot import ros2_section

        fixed["ros2"] = ros2_section(endpoint)
    return _with_values(read(None, environment), fixed)


def sections_of_robots(
    sections: Mapping[str, Any], robots: Sequence[DemoRobot]
) -> tuple[dict[str, Any], ...]:
    """The configuration of each robot's processes, made of that of one robot alone.

    The first robot's is also that of mapper, gateway and router. The section ``simulator`` must be
    valid. CliError if the scene has no room for so many robots.
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
    state = sections["planner"]["state_dir"]
    return tuple(
        _with_values(
            sections,
            {
                "bus": {"namespace": robot.namespace},
                "gateway": {"robots": served},
                "mapper": {"robots": list(served.values())},
                "simulator": {
                    "rgbd_hz": sections["simulator"].get("rgbd_hz", SHARED_RGBD_HZ),
                    "start": [round(value, 3) for value in start],
                },
                "planner": {"state_dir": f"{state}/{robot.name}"},
            },
        )
        for robot, start in zip(robots, starts, strict=True)
    )


def _with_values(
    sections: Mapping[str, Any], values: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    """The sections with these values in place of their own."""
    changed = {name: {**sections.get(name, {}), **part} for name, part in values.items()}
    return {**sections, **changed}


def further_starts(
    scene: Scene, robot: RobotParams, count: int
) -> tuple[tuple[float, float, float], ...]:
    """Starts (x, y, yaw) of ``count`` robots beside the one at the scene's start, which they face.

    Each is as far from those before as the floor reaches. ValueError if it does not hold so many
    robots ``MIN_APART_M`` apart.
    """
    collision = CollisionMap.of(scene, robot.height_m, CELL_SIZE_M)
    x_m, y_m, _ = scene.start
    reachable = collision.reachable_cells(x_m, y_m, robot.radius_m)
    starts: list[tuple[float, float, float]] = []
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


def _processes(
    robots: Sequence[DemoRobot], files: Sequence[Path], process: str
) -> tuple[ProcessSpec, ...]:
    """The router, what simulates the robots, and the services; each reads its robot's file."""
    specs = []
    for name in ("router", process, *(("ros2",) if process == ROS2_ROBOT else ()), *CORE):
        shared = name not in OF_EACH_ROBOT
        for robot, file in list(zip(robots, files, strict=True))[: 1 if shared else None]:
            command = onemap_command(name)
            if name == ROS2_ROBOT:
                command = (sys.executable, "-m", "onemap_tools.demo.ros2_robot")
            of_robot = "" if shared else robot.prefix
            started = (*command, "--config", str(file))
            specs.append(ProcessSpec(of_robot + name, started, last=name == "router"))
    return tuple(specs)


def choose_objects(
    categories: Sequence[str], known: Collection[str], count: int = OBJECTS
) -> tuple[str, ...]:
    """Up to ``count`` objects that the scene has: preferred ones, then others by the alphabet.

    The others must be in ``known``: the planner rejects a search with an unknown word.
    """
    in_scene = set(categories)
    preferred = [name for name in PREFERRED_OBJECTS if name in in_scene]
    others = sorted(
        in_scene.intersection(known) - set(PREFERRED_OBJECTS) - UNINFORMATIVE - {UNNAMED}
    )
    return tuple([*preferred, *others][:count]) or PREFERRED_OBJECTS[:count]
