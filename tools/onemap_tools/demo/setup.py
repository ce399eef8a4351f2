"""What a demo run is made of: its folder, its configuration, its processes, its wishes."""

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
from onemap_simulator.scene.scene import STRUCTURE, UNNAMED
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.launch import ProcessSpec, make_folder, onemap_command
from onemap_tools.processes.network import LOOPBACK, any_free_port, next_free_port
from onemap_tools.processes.services import check_robot

DEMO_FILE = Path(__file__).with_name("demo.yaml")
DEMO_SERVICES = ("simulator", "perception", "mapper", "planner", "gateway")
OBJECTS = 3
DEFAULT_PORT = 8080

# What a demo looks for, as far as it exists: large things that live in different rooms first.
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
# Every scene has them everywhere: finding one shows nothing.
UNINFORMATIVE = STRUCTURE | {"picture", "lamp"}


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """What was asked for on the command line. ``objects`` may be empty: take favourites."""

    seed: int
    scene: Path | None
    objects: tuple[str, ...]
    headless: bool
    port: int
    folder: Path
    time_limit_s: float


@dataclass(frozen=True, slots=True)
class DemoSetup:
    """Everything a demo starts."""

    endpoint: str
    url: str
    config_file: Path
    specs: tuple[ProcessSpec, ...]
    environment: dict[str, str]


def parse_objects(objects: str | None) -> tuple[str, ...]:
    """The objects in a list with commas; none if nothing was asked for. CliError for no names."""
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
    """The port of the live page: the wanted one (0: the usual one, headless any) or the next."""
    if wanted == 0 and headless:
        return any_free_port()
    usual = wanted or DEFAULT_PORT
    port = next_free_port(usual)
    if port != usual:
        console.print(f"Port {usual} is taken; the live page is on {port}.")
    return port


def run_folder(parent: Path, now: datetime, seed: int) -> Path:
    """The folder of a run, not yet made; never one that exists."""
    name = f"{now:%Y%m%d-%H%M%S}-seed{seed}"
    candidates = [parent / name, *(parent / f"{name}-{n}" for n in range(2, 1000))]
    return next(folder for folder in candidates if not folder.exists())


def set_up(options: DemoOptions) -> DemoSetup:
    """Write the run's configuration and say what to start with it; CliError if that could not."""
    endpoint = f"tcp/{LOOPBACK}:{any_free_port()}"
    environment = dict(os.environ)
    sections = demo_sections(environment, options, endpoint)
    check_robot("simulator", sections)
    if options.scene is not None:
        check_scene_file(options.scene)
    make_folder(options.folder)
    config_file = options.folder / "config.yaml"
    config_file.write_text(yaml.safe_dump(sections, sort_keys=False), encoding="utf-8")
    router = ProcessSpec(
        "router", onemap_command("router", "--config", str(config_file)), last=True
    )
    services = (
        ProcessSpec(name, onemap_command(name, "--config", str(config_file)))
        for name in DEMO_SERVICES
    )
    return DemoSetup(
        endpoint=endpoint,
        url=f"http://{LOOPBACK}:{options.port}",
        config_file=config_file,
        specs=(router, *services),
        # The overrides are in the file by now; applied again they would undo what the run needs.
        environment={k: v for k, v in environment.items() if not k.startswith(PREFIX)},
    )


def check_scene_file(path: Path) -> None:
    """CliError if the simulator could not open the scene: told before anything is started."""
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
    """The demo's configuration with the user's overrides, and on top what this run fixes."""
    sections = read(DEMO_FILE, environment)
    fixed: dict[str, dict[str, Any]] = {
        "bus": {"connect": [endpoint], "namespace": ""},
        "gateway": {"host": LOOPBACK, "port": options.port},
        "simulator": {"seed": options.seed},
        "mapper": {"map_folder": str(options.folder / "maps")},
        "planner": {"state_dir": str(options.folder / "planner")},
    }
    if options.scene is not None:
        fixed["simulator"]["scene"] = str(options.scene.resolve())
    for name, values in fixed.items():
        sections[name] = {**sections.get(name, {}), **values}
    return sections


def failed_document(options: DemoOptions, trouble: str) -> dict[str, Any]:
    """The summary of a run that did not get as far as a summary."""
    return {
        "worked": False,
        "seed": options.seed,
        "objects": [],
        "trouble": trouble,
        "folder": str(options.folder),
    }


def choose_objects(categories: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Three objects that exist in the scene, favourites first, then others of the known words.

    A word that the encoder cannot place would have the whole search refused.
    """
    processes = set(categories)
    favourites = [name for name in PREFERRED_OBJECTS if name in processes]
    others = sorted(
        processes.intersection(known) - set(PREFERRED_OBJECTS) - UNINFORMATIVE - {UNNAMED}
    )
    return tuple([*favourites, *others][:OBJECTS]) or PREFERRED_OBJECTS[:OBJECTS]
