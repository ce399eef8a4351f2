"""Prepares a demo run: its configuration, processes and objects to search for."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console

from onemap_shared.config import PREFIX, read
from onemap_shared.sentence import listed_sentences
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.scene.scene import STRUCTURE, UNNAMED
from onemap_simulator.service import APARTMENT, open_scene
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.launch import ProcessSpec, make_folder, onemap_command
from onemap_tools.processes.network import DEFAULT_PORT, LOOPBACK, any_free_port, next_free_port
from onemap_tools.processes.services import CORE, check_robot

SIMULATOR = "simulator"  # in place of the robot
OBJECTS = 3

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
    """The options of the command line. Without ``objects`` the demo chooses them."""

    seed: int
    scene: Path | None
    objects: tuple[str, ...]
    headless: bool
    port: int
    folder: Path
    time_limit_s: float


@dataclass(frozen=True, slots=True)
class DemoSetup:
    """Processes of a run, their environment, and the addresses to reach them.

    warnings: of the scene's file.
    """

    endpoint: str
    url: str
    config_file: Path
    specs: tuple[ProcessSpec, ...]
    environment: dict[str, str]
    warnings: tuple[str, ...] = ()


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


def set_up(options: DemoOptions) -> DemoSetup:
    """Write the run's configuration and list the processes; CliError if it cannot work."""
    endpoint = f"tcp/{LOOPBACK}:{any_free_port()}"
    sections = demo_sections(os.environ, options, endpoint)
    check_robot(SIMULATOR, sections)
    warnings = scene_warnings_of(sections)
    make_folder(options.folder)
    file = options.folder / "config.yaml"
    file.write_text(yaml.safe_dump(sections, sort_keys=False), encoding="utf-8")
    return DemoSetup(
        endpoint=endpoint,
        url=f"http://{LOOPBACK}:{options.port}",
        config_file=file,
        specs=tuple(
            ProcessSpec(name, (*onemap_command(name), "--config", str(file)), last=name == "router")
            for name in ("router", SIMULATOR, *CORE)
        ),
        # Overrides are in the file already; applied again they would replace fixed values.
        environment={k: v for k, v in os.environ.items() if not k.startswith(PREFIX)},
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
    sections = read(None, environment)
    changed = {name: {**sections.get(name, {}), **part} for name, part in fixed.items()}
    return {**sections, **changed}


def choose_objects(categories: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Up to ``OBJECTS`` that the scene has: preferred ones, then others by the alphabet.

    The others must be in ``known``: the planner rejects a search with an unknown word.
    """
    in_scene = set(categories)
    preferred = [name for name in PREFERRED_OBJECTS if name in in_scene]
    others = sorted(
        in_scene.intersection(known) - set(PREFERRED_OBJECTS) - UNINFORMATIVE - {UNNAMED}
    )
    return tuple([*preferred, *others][:OBJECTS]) or PREFERRED_OBJECTS[:OBJECTS]
