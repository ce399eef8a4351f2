"""Prepares a demo run: folder, configuration file, processes and objects to search for."""

from __future__ import annotations

import os
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console

from onemap_shared.config import PREFIX, read
from onemap_simulator.scene.scene import STRUCTURE, UNNAMED
from onemap_tools.demo.robots import (
    DemoRobot,
    check_combination,
    named_robots,
    sections_of_robots,
    with_values,
)
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra
from onemap_tools.processes.launch import ProcessSpec, make_folder, onemap_command
from onemap_tools.processes.network import DEFAULT_PORT, LOOPBACK, any_free_port, next_free_port
from onemap_tools.processes.services import CORE, check_robot

SIMULATOR, ROS2_ROBOT = "simulator", "ros2_robot"  # the processes that simulate the robot
OBJECTS = 3
OBJECTS_EACH = 2  # of several robots
OF_EACH_ROBOT = ("perception", "planner")  # each has its own; the other services are shared

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


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """The options of the command line. Without ``objects`` the demo chooses them.

    ``ros2``: the robot speaks ROS 2. ``robots``: how many, with one map. ``settings``: of the
    configuration's sections, above the environment's.
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
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DemoSetup:
    """Processes of a run, their environment, and the addresses to reach them.

    config_file: of the first robot, and of what the robots share.
    """

    endpoint: str
    url: str
    config_file: Path
    specs: tuple[ProcessSpec, ...]
    environment: dict[str, str]
    robots: tuple[DemoRobot, ...]

    def url_of(self, robot: DemoRobot) -> str:
        """Where a robot's page and API are."""
        return self.url + robot.path


def parse_objects(objects: str | None) -> tuple[str, ...]:
    """Split a comma-separated list; empty for None. CliError if the list holds no name."""
    if objects is None:
        return ()
    names = tuple(name for part in objects.split(",") if (name := part.strip()))
    if not names:
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


def set_up(options: DemoOptions) -> DemoSetup:
    """Write the run's configuration and list the processes; CliError if it cannot work."""
    check_combination(
        options.robots,
        objects=options.objects,
        ros2=options.ros2,
    )
    endpoint = f"tcp/{LOOPBACK}:{any_free_port()}"
    environment = dict(os.environ)
    sections = demo_sections(environment, options, endpoint)
    check_robot(SIMULATOR, sections)
    if options.ros2:
        check_robot("ros2", sections)
    if options.scene is not None:
        check_scene_file(options.scene)
    robots = named_robots(options.robots, ROS2_ROBOT if options.ros2 else SIMULATOR)
    parts = sections_of_robots(sections, robots)
    make_folder(options.folder)
    files = [options.folder / f"{robot.prefix}config.yaml" for robot in robots]
    for file, part in zip(files, parts, strict=True):
        file.write_text(yaml.safe_dump(part, sort_keys=False), encoding="utf-8")
    return DemoSetup(
        endpoint=endpoint,
        url=f"http://{LOOPBACK}:{options.port}",
        config_file=files[0],
        specs=_processes(robots, files, ros2=options.ros2),
        # Their overrides are in the file already; applied again they would replace fixed values.
        environment={
            **{k: v for k, v in environment.items() if not k.startswith(PREFIX)},
            **(_ros2_environment(endpoint) if options.ros2 else {}),
        },
        robots=robots,
    )


def _processes(
    robots: Sequence[DemoRobot], files: Sequence[Path], *, ros2: bool
) -> tuple[ProcessSpec, ...]:
    """The router, what simulates the robots, and the services; each reads its robot's file."""

    def shared(name: str) -> ProcessSpec:
        command = onemap_command(name, "--config", str(files[0]))
        return ProcessSpec(name, command, last=name == "router")

    def of_each(name: str) -> Iterator[ProcessSpec]:
        for robot, file in zip(robots, files, strict=True):
            yield ProcessSpec(robot.prefix + name, onemap_command(name, "--config", str(file)))

    services = (
        spec
        for name in CORE
        for spec in (of_each(name) if name in OF_EACH_ROBOT else (shared(name),))
    )
    simulated = _ros2_processes(files[0]) if ros2 else tuple(of_each(SIMULATOR))
    return (shared("router"), *simulated, *services)


def _ros2_processes(file: Path) -> tuple[ProcessSpec, ...]:
    """The simulator behind ROS 2's formats, and the adapter."""
    robot = (sys.executable, "-m", "onemap_tools.demo.ros2_robot", "--config", str(file))
    adapter = onemap_command("ros2", "--config", str(file))
    return (ProcessSpec(ROS2_ROBOT, robot), ProcessSpec("ros2", adapter))


def _ros2_environment(endpoint: str) -> dict[str, str]:
    from onemap_tools.demo.ros2_robot import ROUTER_VARIABLE

    return {ROUTER_VARIABLE: endpoint}


def check_scene_file(path: Path) -> None:
    """CliError if the simulator cannot open the scene file."""
    from onemap_simulator.scene.loading import load_scene

    try:
        load_scene(path)
    except ValueError as problem:
        raise CliError(
            f"{problem}. 'onemap scene check {path}' shows more.", EXIT_USAGE_ERROR
        ) from problem


def demo_sections(
    environment: Mapping[str, str], options: DemoOptions, endpoint: str
) -> dict[str, Any]:
    """The demo's configuration: the environment, then the values of this run."""
    sections = read(None, environment)
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
    return with_values(with_values(sections, options.settings), fixed)


def failed_document(options: DemoOptions, reason: str) -> dict[str, Any]:
    """The summary document of a run that failed before its search ended."""
    return {
        "worked": False,
        "seed": options.seed,
        "objects": [],
        "trouble": reason,
        "folder": str(options.folder),
    }


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
