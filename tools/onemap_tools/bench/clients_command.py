"""``onemap bench clients``: queries of many clients at once."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json, Token, Url
from onemap_tools.cli.terminal import print_json
from onemap_tools.processes.network import DEFAULT_URL

app = typer.Typer()


@app.command()
def clients(
    *,
    url: Url = DEFAULT_URL,
    token: Token = "",
    count: Annotated[int, typer.Option("--clients", min=1, max=500, help="That ask.")] = 50,
    seconds: Annotated[float, typer.Option(min=1, help="Of asking.")] = 20.0,
    new: Annotated[
        float, typer.Option(min=0, max=1, help="Share of texts that nobody asked for before.")
    ] = 0.2,
    pause: Annotated[
        float, typer.Option(min=0, help="Seconds from a client's answer to its next question.")
    ] = 1.0,
    as_json: Json = False,
) -> None:
    """How long queries take when many clients ask a running gateway at once.

    Start 'onemap up' or 'onemap demo' before, with the rate of frames that the map
    should fuse meanwhile. Each client has a connection of its own and asks, waits
    for the answer, and pauses. fused_hz is what the map fused while they asked.
    """
    with cli_errors("demo"):
        from onemap_tools.bench import clients as bench
        from onemap_tools.gateway import gateway_client

        params = bench.ClientsBenchParams(count, seconds, new_share=new, pause_s=pause)
        result = bench.run(lambda: gateway_client(url, token), params)
    if as_json:
        print_json(result)
    else:
        print("\n".join(f"{name:14} {value}" for name, value in result.items()))
