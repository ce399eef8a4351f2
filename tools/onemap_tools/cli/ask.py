"""Commands that ask a running robot."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import Console

from onemap_tools.cli.options import (
    FIRST,
    OPERATE,
    RECORDINGS,
    Config,
    Json,
    MaxDistance,
    MaxTime,
    Token,
    Url,
    parse_area,
)
from onemap_tools.cli.terminal import asked, print_json, progress_console, result_console, show
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, CliError
from onemap_tools.processes.network import DEFAULT_URL

if TYPE_CHECKING:
    from onemap import Client

REPLAY_EPILOG = (
    "The planner records the last 50 searches in the folder 'decisions' of planner.state_dir, one "
    "file of JSON lines each, with the goals that were weighed. 'onemap search -- replay' searches "
    "for a thing called replay."
)
Crop = Annotated[
    Path | None, typer.Option(dir_okay=False, help="A picture of it instead of words, PNG or JPEG.")
]
Negatives = Annotated[
    list[str] | None, typer.Option("--not", help="What it must not be; may be repeated.")
]
Area = Annotated[
    str, typer.Option(help="Only in this part of the map: x_min,y_min,x_max,y_max in metres.")
]
app = typer.Typer()


@app.command(rich_help_panel=FIRST)
def query(
    text: Annotated[
        list[str] | None, typer.Argument(help="An object, as: red mug on the table.")
    ] = None,
    *,
    image: Crop = None,
    regions: Annotated[int, typer.Option(min=1, max=100, help="How many places at most.")] = 5,
    negative: Negatives = None,
    area: Area = "",
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Where is it? Places on the map that look like it, best first, and a verdict.

    Found, not here (the reachable area was looked at), or not looked yet, with the
    place to look at next. A text may list several: "sofa, bed". Exit code 0 only if
    all were found. The scores of an image rank places; they are no probabilities.
    """
    from onemap import QueryOptions
    from onemap_shared.sentence import listed_sentences
    from onemap_tools.cli import remote
    from onemap_tools.gateway import gateway_client

    options = QueryOptions(regions, tuple(negative or ()), parse_area(area))
    words = " ".join(text or ())
    try:
        several = len(listed_sentences(words)) > 1
    except ValueError as problem:
        raise typer.BadParameter(f"{problem}") from problem
    if bool(words) == (image is not None) or (image is not None and negative):
        raise typer.BadParameter("name an object, or give --image without --not")
    crop = None if image is None else remote.read_crop(image)
    with gateway_client(url, token) as gateway:
        if crop is not None:
            results = [gateway.query_image(crop, options)]
        elif several:
            results = [*gateway.query_all([words], options)]
        else:
            results = [
                gateway.query(words, regions, negatives=options.negatives, area_m=options.area_m)
            ]
    documents = [dict(each.document) for each in results]
    shown = documents[0] if len(documents) == 1 else {"answers": documents}
    show(shown, as_json, remote.describe_queries)
    raise typer.Exit(EXIT_OK if all(each.found for each in results) else EXIT_FAILED)


@app.command(rich_help_panel=FIRST)
def search(
    objects: Annotated[
        list[str] | None,
        typer.Argument(help="Objects, one after the other, as: bed 'lamp near the bed'."),
    ] = None,
    *,
    again: Annotated[
        bool,
        typer.Option(
            "--again",
            help="Ask again for what is left when the planner or the robot's driver ends; without "
            "objects, of the last search.",
        ),
    ] = False,
    after: Annotated[
        Literal["stay", "return"],
        typer.Option(help="When all are done, found or not: stay, or return to where it set out."),
    ] = "stay",
    max_distance: MaxDistance = None,
    max_time: MaxTime = None,
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Go and find. Ctrl-C cancels. Exit code 0 only if all were found."""
    from onemap import SearchLimits
    from onemap_tools.cli import remote
    from onemap_tools.gateway import gateway_client

    if not (objects or again):
        raise typer.BadParameter("name an object, or go on with the last search by --again")
    with gateway_client(url, token) as gateway:
        limits = SearchLimits(max_distance, max_time)
        begin = partial(gateway.search, tuple(objects or ()), limits=limits, after=after)
        start = begin if objects else gateway.searches.get().again
        report, exit_code = remote.follow(gateway, start, progress_console(), again=again)
    show(report, as_json, remote.describe_search)
    raise typer.Exit(exit_code)


@app.command("search list", rich_help_panel=RECORDINGS)
def search_list(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """The searches of the robot, also past ones, the newest first."""
    from onemap_tools.cli import remote

    listed = asked(url, token, lambda gateway: gateway.searches.list())
    searches = [dict(each.latest.document) for each in listed]
    show({"searches": searches}, as_json, remote.describe_searches)


@app.command("search replay", rich_help_panel=RECORDINGS, epilog=REPLAY_EPILOG)
def search_replay(
    identifier: Annotated[str, typer.Argument(help="The id that 'onemap search list' shows.")],
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Why did the robot drive there? Each step of a past search."""
    from onemap_tools.cli.past_search import describe_replay

    replay = asked(url, token, lambda gateway: gateway.searches.get(identifier).replay())
    result_console(as_json).print(*describe_replay(replay), sep="\n", soft_wrap=True)
    if as_json:
        print_json(dict(replay.document))


@app.command(rich_help_panel=FIRST, context_settings={"ignore_unknown_options": True})
def go(
    place: Annotated[
        list[str],
        typer.Argument(
            help="Metres along the map's x and y, as: 2.5 -1; or the name of a place, as: kitchen; "
            "or back: where the robot stood when the last search or drive was accepted."
        ),
    ],
    *,
    look: Annotated[
        bool, typer.Option("--look", help="Drive only to where the place can be seen, and face it.")
    ] = False,
    max_distance: MaxDistance = None,
    max_time: MaxTime = None,
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Drive to a place in the map. Ctrl-C cancels. Exit code 0 only if the robot arrived."""
    from onemap import SearchLimits
    from onemap_tools.cli import remote
    from onemap_tools.gateway import gateway_client

    with gateway_client(url, token) as gateway:
        limits = SearchLimits(max_distance, max_time)
        if (xy := _metres(place)) is not None:
            start = partial(gateway.look_at if look else gateway.go_to, *xy, limits=limits)
        elif look:
            raise typer.BadParameter("--look needs x and y in metres")
        else:
            start = partial(gateway.go_to_place, " ".join(place), limits=limits)
        report, exit_code = remote.follow(gateway, start, progress_console())
    show(report, as_json, remote.describe_drive)
    raise typer.Exit(exit_code)


def _metres(place: list[str]) -> tuple[float, float] | None:
    """The two numbers that a place is given by; None if it is a name."""
    try:
        x_m, y_m = map(float, place)
    except ValueError:
        if any(_is_number(each) or each.startswith("-") for each in place):
            raise typer.BadParameter("give x and y in metres, or the name of a place") from None
        return None
    return x_m, y_m


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@app.command(rich_help_panel=FIRST)
def objects(url: Url = DEFAULT_URL, token: Token = "", as_json: Json = False) -> None:
    """What was found on this map, and where, the last first."""
    from onemap_tools.cli import remote

    found = asked(url, token, lambda gateway: gateway.objects())
    show({"objects": [dict(each.document) for each in found]}, as_json, remote.describe_objects)


@app.command("objects forget", rich_help_panel=OPERATE)
def forget(
    identifier: Annotated[str, typer.Argument(help="The id that 'onemap objects' shows.")],
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """Remove an object that was found wrongly."""
    forgotten = asked(url, token, lambda gateway: dict(gateway.forget_object(identifier).document))

    def describe(known: dict[str, Any], console: Console) -> None:
        console.print(f"Forgot the {known['name']} with the id {known['id']}.", soft_wrap=True)

    show(forgotten, as_json, describe)


@app.command(rich_help_panel=FIRST)
def status(
    *,
    service: Annotated[
        str, typer.Option(help="Only this one, by its heartbeat on the bus, without the gateway.")
    ] = "",
    config: Annotated[
        Path | None,
        typer.Option("--config", help="With --service: YAML file that says where the bus is."),
    ] = None,
    url: Url = DEFAULT_URL,
    token: Token = "",
    as_json: Json = False,
) -> None:
    """What runs, and how. Exit code 0 only if a search could start now.

    With --service: 0 only if that service says that it is ready.
    """
    if service:
        from onemap_tools.processes.session import check_service

        check_service(service, config)
        if as_json:
            print_json({"service": service, "ready": True})
        return
    from onemap_tools.cli import remote

    def ask(gateway: Client) -> tuple[dict[str, Any], str]:
        return dict(gateway.status().document), remote.interrupted(gateway)

    document, offered = asked(url, token, ask)

    def describe(status: dict[str, Any], console: Console) -> None:
        remote.describe_status(status, console)
        if offered:
            console.print(offered, soft_wrap=True)

    show(document, as_json, describe)
    raise typer.Exit(EXIT_OK if document["ready"] else EXIT_FAILED)


@app.command(rich_help_panel=FIRST)
def doctor(config: Config = None, token: Token = "", as_json: Json = False) -> None:
    """Why is nothing found? Listens on the bus and says so. Exit code 0 unless there are errors."""
    try:
        from onemap_tools import doctor
    except ModuleNotFoundError as problem:
        missing = f"'onemap doctor' needs {problem.name}: run it where the gateway is installed"
        raise CliError(f"{missing}, as in the gateway's container.") from problem
    findings = doctor.examine(config, token, progress_console())
    doctor.describe(findings, result_console(as_json))
    if as_json:
        print_json(doctor.document(findings))
    raise typer.Exit(EXIT_OK if doctor.healthy(findings) else EXIT_FAILED)
