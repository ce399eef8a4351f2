"""``onemap ros2 topics``: what a ROS 2 robot publishes, at which rate, and what is missing."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.run import PANEL
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, CliError, requires_extra

app = typer.Typer()


@app.command("ros2 topics", rich_help_panel=PANEL)
def topics(
    config: Config = None,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=60, help="How long messages are counted.")
    ] = 3.0,
    as_json: Json = False,
) -> None:
    """Topics of the robot: types, publishers, subscribers, rates.

    Reads section ros2 of the configuration for the robot's router. Exit code 1 if a topic that it
    names is missing, with the nearest one of the right type.
    """
    from onemap_shared.config import load
    from onemap_tools.cli.terminal import print_json, result_console

    with requires_extra("ros2", "This command"):
        from onemap_ros2.config import Ros2Config
        from onemap_ros2.discovery import survey

    _, _, robot = load(config, "ros2", Ros2Config)
    try:
        reports, missing = survey(robot, seconds)
    except ConnectionError as problem:
        raise CliError(f"{problem}.") from problem
    console = result_console(as_json)
    for report in reports:
        rate = "-" if report.rate_hz is None else f"{report.rate_hz:.1f} Hz"
        mark = f"  <- {report.setting}" if report.setting else ""
        console.print(
            f"{report.topic:48} {report.ros_type:34} {report.publishers} publish, "
            f"{report.subscribers} subscribe {rate:>9}{mark}",
            soft_wrap=True,
        )
    for sentence in missing:
        console.print(f"missing: {sentence}", soft_wrap=True)
    if as_json:
        print_json({"topics": [asdict(each) for each in reports], "missing": missing})
    raise typer.Exit(EXIT_FAILED if missing else EXIT_OK)
