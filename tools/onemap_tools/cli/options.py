"""Options that several commands share, and the version that they report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_shared.services import installed_version
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

# The panels of ``onemap --help``, in this order.
FIRST, RECORDINGS = "Begin here", "Recordings and viewers"
OPERATE, DEEPER = "Run it for good", "Look deeper"

Config = Annotated[
    Path | None,
    typer.Option("--config", help="YAML file of this deployment; defaults apply without it."),
]
Json = Annotated[
    bool, typer.Option("--json", help="Print the result as one JSON object, the last line.")
]
MaxDistance = Annotated[
    float | None,
    typer.Option(
        "--max-distance", help="Metres that the robot may drive; beyond, the search fails."
    ),
]
MaxTime = Annotated[
    float | None,
    typer.Option("--max-time", help="Seconds that it may take; beyond, the search fails."),
]
Url = Annotated[str, typer.Option("--url", envvar="ONEMAP_URL", help="Address of the gateway.")]
Token = Annotated[
    str, typer.Option("--token", envvar="ONEMAP_TOKEN", help="The gateway's token, if it has one.")
]


def parse_area(text: str) -> tuple[float, float, float, float] | None:
    """x_min, y_min, x_max, y_max in metres of ``x,y,x,y``; None for an empty text."""
    if not text:
        return None
    try:
        x_min, y_min, x_max, y_max = (float(part) for part in text.split(","))
    except ValueError as problem:
        raise CliError(
            f"--area is {text!r}; write x_min,y_min,x_max,y_max in metres, as in 0,-1.5,4,3",
            EXIT_USAGE_ERROR,
        ) from problem
    return x_min, y_min, x_max, y_max


def version() -> str:
    """The version of the installed package, or that it is not installed."""
    return installed_version() or "from sources that are not installed (pip install -e .)"
