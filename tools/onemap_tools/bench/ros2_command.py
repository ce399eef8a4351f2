"""``onemap bench ros2``: what the ROS 2 adapter adds to a frame."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json

app = typer.Typer()


@app.command()
def ros2(
    frames: Annotated[int, typer.Option(min=1, help="To make of each form of images.")] = 100,
    as_json: Json = False,
) -> None:
    """Milliseconds that the ROS 2 adapter adds to a frame of 640 x 480 pixels.

    From the bytes of a color and a depth image, as Zenoh has them, to the frame that
    goes on OneMap's bus: copied, paired, decoded, placed by the transforms. In one
    thread; copies are those of the pixels.
    """
    with cli_errors("ros2"):
        from onemap_tools.bench import ros2 as bench

        result = bench.run(frames)
    for name, form in result["forms"].items():
        typer.echo(
            f"{name:24} {form['p50_ms']:6.2f} ms in the median, {form['min_ms']:6.2f} at least, "
            f"{form['cpu_p50_ms']:6.2f} of the processor; copies: {form['copies']}",
            err=as_json,
        )
    if as_json:
        print_json(result)
