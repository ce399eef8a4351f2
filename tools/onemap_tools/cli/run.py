"""Commands that run the demo, the router and the services on this machine."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timezone
from pathlib import Path
from typing import Annotated

import typer

from onemap_shared.services import SERVICES
from onemap_tools.cli.options import FIRST, OPERATE, Config, Json
from onemap_tools.cli.terminal import print_json, progress_console, stays_up
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, requires_extra
from onemap_tools.processes.network import DEFAULT_PORT

Scene = Annotated[
    Path | None,
    typer.Option(
        exists=True,
        dir_okay=False,
        help="A GLB, glTF, OBJ or PLY file instead. A YAML file beside it with the same name "
        "corrects it: categories (node: name), start (x, y, yaw), up (y or z).",
    ),
]
Objects = Annotated[
    str | None,
    typer.Option(help="Names or sentences, separated by commas; by default what the scene has."),
]
PagePort = Annotated[
    int,
    typer.Option(
        min=0,
        max=65535,
        help=f"Port of the live page; 0: {DEFAULT_PORT}, or any free one if headless.",
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
        help="Seconds until the search is cancelled, counted anew once the mapper has compiled "
        "its kernels, at the first start.",
    ),
]
app = typer.Typer()
service_app = typer.Typer(no_args_is_help=True, help="One service or the router, in this process.")


@app.command(rich_help_panel=FIRST)
def demo(
    *,
    seed: Annotated[int, typer.Option(min=0, help="Which generated apartment.")] = 1,
    scene: Scene = None,
    objects: Objects = None,
    headless: Headless = None,
    port: PagePort = 0,
    out: RunsFolder = Path("runs"),
    time_limit: TimeLimit = 360.0,
    as_json: Json = False,
) -> None:
    """Everything on this machine: a simulated robot searches for three objects.

    Exit code 0 only if all were found and the simulator confirms it, also where Ctrl-C ends the
    demo after the search. It cannot confirm objects that a scene file does not name: there the
    robot's claim counts.
    """
    from onemap_tools.demo.setup import DemoOptions, choose_port, parse_objects, run_folder
    from onemap_tools.demo.start import run

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
    )
    document = run(options, console)
    if as_json:
        print_json(document)
    raise typer.Exit(EXIT_OK if document["worked"] else EXIT_FAILED)


@app.command(rich_help_panel=FIRST)
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
    from onemap_tools.processes import up as command

    names = [name for part in only.split(",") if (name := part.strip())]
    command.up(config, names, logs, progress_console())


@app.command(rich_help_panel=OPERATE)
def certs(
    folder: Annotated[
        Path,
        typer.Argument(
            help="Folder for them; those that are there, valid and for these hosts stay."
        ),
    ],
    host: Annotated[
        list[str],
        typer.Option(help="Name or address under which clients reach the router; repeat it."),
    ],
    days: Annotated[
        int, typer.Option(min=1, max=3650, help="How long they are valid; make new ones in time.")
    ] = 825,
    as_json: Json = False,
) -> None:
    """Make the authority of a bus, and a certificate for its router and for each role.

    Over TLS the router lets a client do only what the role in its certificate's name does. Give
    each machine NAME.pem, NAME.key and ca.pem of its roles; keep ca.key away from all of them.
    """
    with requires_extra("certs", "This command"):
        from onemap_tools.certificates import write_certificates

    made = write_certificates(folder, host, now=datetime.now(timezone.utc), days=days)
    if as_json:
        print_json({"folder": str(folder), "made": made})
        return
    for name, new in made.items():
        typer.echo(f"{folder / name}.pem, .key: {'made' if new else 'kept'}")


@service_app.command()
@app.command(hidden=True)
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


def _service_command(name: str) -> Callable[[Path | None], None]:
    def command(config: Config = None) -> None:
        from onemap_tools.processes.services import run

        run(name, config)

    return command


for service in SERVICES.values():
    summary = f"{service.summary[0].upper()}{service.summary[1:]}."
    run_it = _service_command(service.name)
    service_app.command(name=service.name, help=summary)(run_it)
    if service.name != "replay":  # which is a command of its own
        app.command(name=service.name, help=summary, hidden=True)(run_it)
