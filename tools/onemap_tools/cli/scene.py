"""``onemap scene``: check a scene file before a robot searches in it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json, result_console
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR, CliError, requires_extra

app = typer.Typer(no_args_is_help=True, help="Look at a scene file of your own.")


@app.callback()
def scene() -> None:
    """Look at a scene file of your own."""


@app.command()
def check(
    file: Annotated[
        Path, typer.Argument(exists=True, dir_okay=False, help="A GLB, glTF, OBJ or PLY file.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(dir_okay=False, help="Write the floor plan from above to this PNG file."),
    ] = None,
    as_json: Json = False,
) -> None:
    """What the simulator understands of a scene file, and whether a robot can search there.

    A YAML file beside it with the same name (flat.glb: flat.yaml) corrects it. All keys may be
    left out:

    categories: what nodes are, each as node name: category;

    start: where the robot starts, a list of x, y in metres and yaw in radians;

    up: the axis that points up, y or z.

    Exit code 0 if a robot can search there, 1 if it cannot, 2 if the file is no scene.
    """
    with requires_extra("simulator", "This command"):
        from onemap_tools.cli import scene_report

    if out is not None and out.suffix.lower() != ".png":
        raise CliError(f"The picture is a PNG file; {out} does not end in .png.", EXIT_USAGE_ERROR)
    inspection = scene_report.examine(file)
    picture = scene_report.draw(inspection, out) if out is not None else None
    scene_report.describe(inspection, picture, result_console(as_json))
    if as_json:
        print_json(scene_report.document(inspection, picture))
    raise typer.Exit(EXIT_OK if inspection.searchable else EXIT_FAILED)
