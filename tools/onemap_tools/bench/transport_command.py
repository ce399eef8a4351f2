"""``onemap bench transport``."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.cli.options import Json
from onemap_tools.cli.terminal import print_json

app = typer.Typer()

Size = Annotated[str, typer.Option(help="Of the camera's image.")]
Link = Annotated[
    float, typer.Option(min=0, help="Mbit/s each way between perception and robot; 0: none.")
]
CongestionControl = Annotated[
    str, typer.Option(help="Of TCP over the link, such as bbr or reno; default: the machine's.")
]
Streams = Annotated[
    list[int] | None, typer.Option(min=1, max=64, help="Robots at once; may be repeated.")
]


class SettingName(str, Enum):
    """What is done to frames and fields."""

    RAW = "raw"
    WINDOW = "window"
    COMPRESSED = "compressed"
    THIN = "thin"
    NARROW = "narrow"


@app.command()
def transport(
    *,
    link: Link = 0.0,
    delay: Annotated[float, typer.Option(min=0, help="Milliseconds each way.")] = 0.0,
    loss: Annotated[float, typer.Option(min=0, max=50, help="Percent of packets.")] = 0.0,
    congestion_control: CongestionControl = "",
    setting: Annotated[list[SettingName] | None, typer.Option(help="Default: all.")] = None,
    streams: Streams = None,
    rate: Annotated[float, typer.Option(min=0.1, max=60, help="Frames per second.")] = 15.0,
    encode: Annotated[float, typer.Option(min=0, help="Milliseconds of perception a frame.")] = 30,
    size: Size = "320x240",
    seconds: Annotated[float, typer.Option(min=1, help="That count, after three others.")] = 10.0,
    as_json: Json = False,
) -> None:
    """What a link carries: rate and age of the fields that reach the map.

    Router, robots, perception and map are processes of their own; frames are those
    of a simulated camera with noisy depth, fields what mini makes of them, computed
    beforehand. With --link, perception is in a network namespace of its own behind
    a link of that rate, delay and loss (Linux, as root); without, all is on loopback.

    raw: no setting. window: two frames under way. compressed: JPEG, lossless depth,
    int8 features, 8-bit variances. thin: both. narrow: thin with 128 of mini's 384
    channels. Ages count from the capture until the map has the field;
    router_ms_per_frame is the router's processor time for a frame and its field.
    """
    with cli_errors("demo"):
        from onemap_perception.encoders.mini import MiniParams
        from onemap_tools.bench.perception import parse_size
        from onemap_tools.bench.transport import benchmark as bench
        from onemap_tools.bench.transport.link_shape import LinkShape
        from onemap_tools.bench.transport.streams import make_stream

        shape = LinkShape(link * 1e6, delay * 1e-3, loss * 1e-2) if link else None
        bench.check(shape)
        chosen = {each.value: bench.SETTINGS[each.value] for each in setting or SettingName}
        made = {
            channels: make_stream(MiniParams(channels=channels), parse_size(size))
            for channels in {each.channels for each in chosen.values()}
        }
        rows = []
        for count in streams or [1]:
            params = bench.TransportBenchParams(
                shape, congestion_control, count, rate, encode * 1e-3, seconds
            )
            for row in bench.run(made, chosen, params):
                rows.append(row)
                typer.echo("  ".join(f"{name} {value}" for name, value in row.items()), err=as_json)
    if as_json:
        print_json({"benchmark": "transport", "link_mbit_s": link, "results": rows})
