"""Commands that run the demo, the router and the services on this machine."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from onemap_shared.services import SERVICES
from onemap_tools.cli.options import Config, Json
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, requires_extra
from onemap_tools.processes.network import DEFAULT_PORT

PANEL = "Run"
Scene = Annotated[
    Path | None,
    typer.Option(
        exists=True,
        dir_okay=False,
        help="A GLB, glTF, OBJ or PLY file instead. A YAML file beside it with the same name "
        "corrects it: categories (node: name), start (x, y, yaw), up (y or z). See 'onemap scene "
        "check'.",
    ),
]
Objects = Annotated[
    str | None,
    typer.Option(help="What to find, separated by commas; by default what the scene has."),
]
PagePort = Annotated[
    int, typer.Option(min=0, max=65535, help=f"Of the live page; 0: {DEFAULT_PORT}, headless any.")
]
Film = Annotated[
    Path | None,
    typer.Option(
        dir_okay=False,
        help="Write an animation of the search here (.webp, .gif or .png): at most 15 s and 3 MB.",
    ),
]
Headless = Annotated[
    bool | None,
    typer.Option(
        help="End after the search; by default where the output is no terminal.",
        show_default=False,
    ),
]
RunsFolder = Annotated[
    Path, typer.Option(file_okay=False, help="Where the folder of the run is made.")
]
TimeLimit = Annotated[
    float,
    typer.Option(
        min=1,
        help="Seconds; then the search is cancelled. They begin anew when the mapper has compiled "
        "its kernels, at the first start.",
    ),
]
Robots = Annotated[
    int, typer.Option(help="How many simulated robots, which share one map; two need 2 cores.")
]
Ros2 = Annotated[
    bool,
    typer.Option("--ros2", help="The robot speaks ROS 2's formats, through the adapter."),
]
app = typer.Typer()


@app.command(rich_help_panel=PANEL)
def demo(
    *,
    seed: Annotated[int, typer.Option(min=0, help="Which generated apartment.")] = 1,
    scene: Scene = None,
    objects: Objects = None,
    headless: Headless = None,
    port: PagePort = 0,
    out: RunsFolder = Path("runs"),
    time_limit: TimeLimit = 360.0,
    film: Film = None,
    robots: Robots = 1,
    ros2: Ros2 = False,
    as_json: Json = False,
) -> None:
    """Everything on this machine: a simulated robot searches for three objects.

    With --robots 2 two of them search for four and share one map: one that has found its object
    takes the next. Each is simulated on its own, so that they neither see nor touch one another.

    Exit code 0 only if all were found and the simulator confirms it. It cannot confirm objects
    that a scene file does not name: there the robot's claim counts. See 'onemap scene check'.
    """
    from onemap_tools.cli.terminal import print_json, progress_console, stays_up
    from onemap_tools.demo.run import run_with_report
    from onemap_tools.demo.setup import DemoOptions, choose_port, parse_objects, run_folder

    console = progress_console()
    stay = stays_up(headless)
    options = DemoOptions(
        seed=seed,
        scene=scene,
        objects=parse_objects(objects),
        headless=not stay,
        port=choose_port(port, headless=not stay, console=console),
        folder=run_folder(out, datetime.now(), seed),
        time_limit_s=time_limit,
        film=film,
        ros2=ros2,
        robots=robots,
    )
    document = run_with_report(options, console)
    if as_json:
        print_json(document)
    raise typer.Exit(EXIT_OK if document["worked"] else EXIT_FAILED)


@app.command(rich_help_panel=PANEL)
def up(
    config: Config = None,
    only: Annotated[
        str, typer.Option(help="Start only these, separated by commas: router, mapper, ...")
    ] = "",
    logs: Annotated[Path, typer.Option(file_okay=False, help="Folder for the logs.")] = Path(
        "runs/up"
    ),
) -> None:
    """All services on this machine until Ctrl-C; a service that crashes is started again.

    The robot is the one that the configuration has a section for: simulator, replay or ros2.
    A router is started if the configuration expects one here and none answers. Nothing is
    started if one of the services runs on the bus already, or if the page's port is taken.
    """
    from onemap_tools.cli.terminal import progress_console
    from onemap_tools.processes import up as command

    names = [name for part in only.split(",") if (name := part.strip())]
    command.up(config, names, logs, progress_console())


@app.command(rich_help_panel=PANEL)
def router(
    config: Config = None,
    listen: Annotated[
        list[str] | None, typer.Option(help="Endpoint to listen on, e.g. tcp/0.0.0.0:7447.")
    ] = None,
    zenoh_config: Annotated[
        Path | None, typer.Option(help="A JSON5 file as zenohd reads it.")
    ] = None,
) -> None:
    """The Zenoh router that all services connect to."""
    from onemap_tools.processes import router as command

    command.run(config, listen or (), zenoh_config)


def _run_service(name: str, config: Path | None) -> None:
    from onemap_tools.processes.services import run

    raise typer.Exit(run(name, ("--config", str(config)) if config is not None else ()))


def _service_command(name: str) -> Callable[[Path | None], None]:
    def command(config: Config = None) -> None:
        _run_service(name, config)

    return command


def replay(
    path: Annotated[
        Path | None,
        typer.Argument(
            exists=True,
            help="A folder with frames.json and PNG files, or an MCAP file: of 'onemap record', "
            "or a ROS 2 bag.",
        ),
    ] = None,
    config: Config = None,
    *,
    reencode: Annotated[
        bool,
        typer.Option("--reencode", help="From the images, with the encoder of --config."),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            dir_okay=False,
            help="Write the map here (*.npz); 'onemap map load' takes it from mapper.map_folder.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """A recording: a folder in place of a robot, or the map of an MCAP file once more.

    A folder is published like a robot until Ctrl-C. Of an MCAP file the map is computed again, in
    this process alone, and compared with the digests in it. Exit code 0 if all are the same, 1 if
    one differs or none could be compared, 2 if the file cannot be read; with --reencode nothing
    is compared. Of a ROS 2 bag the images are encoded; the section ros2 of --config names its
    topics and frames.
    """
    if path is not None and path.is_file():
        _rebuild(path, config, reencode=reencode, out=out, as_json=as_json)
    if path is not None:
        os.environ["ONEMAP__REPLAY__DIRECTORY"] = json.dumps(str(path))
    _run_service("replay", config)


def _rebuild(
    path: Path, config: Path | None, *, reencode: bool, out: Path | None, as_json: bool
) -> NoReturn:
    with requires_extra("record,mapper,perception,ros2", "The replay of a file"):
        from onemap_tools.bag import replay as command
    from onemap_tools.cli.terminal import print_json, result_console

    options = command.ReplayOptions(path, config=config, reencode=reencode, out=out)
    document = command.replay(options)
    result_console(as_json).print(*command.describe(document), sep="\n", soft_wrap=True)
    if as_json:
        print_json(document)
    raise typer.Exit(EXIT_OK if document["same"] or document["reencoded"] else EXIT_FAILED)


for service in SERVICES.values():
    app.command(
        name=service.name,
        help=None
        if service.name == "replay"
        else f"{service.summary[0].upper()}{service.summary[1:]}.",
        rich_help_panel=PANEL,
    )(replay if service.name == "replay" else _service_command(service.name))
