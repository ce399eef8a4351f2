"""``onemap certs``: the certificates of the bus."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.cli.options import Json
from onemap_tools.cli.run import PANEL

app = typer.Typer()


@app.command(rich_help_panel=PANEL)
def certs(
    folder: Annotated[Path, typer.Argument(help="Where they are written; existing ones are kept.")],
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
    from datetime import datetime, timezone

    from onemap_tools.cli.terminal import print_json
    from onemap_tools.errors import CliError

    try:
        from onemap_tools.certificate_files import write_certificates
    except ModuleNotFoundError as problem:
        raise CliError(
            f"It needs the package {problem.name!r}: install it with pip install 'onemap[certs]'."
        ) from problem
    made = write_certificates(folder, host, now=datetime.now(timezone.utc), days=days)
    if as_json:
        print_json({"folder": str(folder), "made": made})
        return
    for name, new in made.items():
        typer.echo(f"{folder / name}.pem, .key: {'made' if new else 'kept'}")
