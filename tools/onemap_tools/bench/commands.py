"""``onemap bench``: measure on this machine."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from onemap_tools.bench.cli_errors import cli_errors
from onemap_tools.bench.clients_command import app as clients_app
from onemap_tools.bench.fusion_command import app as fusion_app
from onemap_tools.bench.habitat.command import app as habitat_app
from onemap_tools.bench.navigation.choices import Apartments, Errors, Features, Method, ObjectOrder
from onemap_tools.bench.options import (
    Beside,
    FeaturesOption,
    Frames,
    Labels,
    MethodOption,
    ObjectsPerEpisode,
    Order,
    Parity,
    Places,
    ResultsFolder,
    SceneOrRecording,
    SceneOut,
    SimulatedErrors,
    Stairwells,
    Threads,
)
from onemap_tools.bench.query_command import app as query_app
from onemap_tools.bench.transport_command import app as transport_app
from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.terminal import print_json
from onemap_tools.errors import EXIT_FAILED, EXIT_OK

PANEL = "Look deeper"
app = typer.Typer(no_args_is_help=True, help="Measure on this machine.")
app.add_typer(habitat_app)  # without a name of its own: a command beside the others
for group in (clients_app, fusion_app, query_app, transport_app):
    app.add_typer(group)


class Backend(str, Enum):
    """Encoders that can be measured with random weights."""

    MINI = "mini"
    OPENCLIP_CONVNEXT = "openclip_convnext"
    TIPSV2 = "tipsv2"


class SearchStyle(str, Enum):
    """Look of the apartments to search in."""

    TRAINING = "training"
    HELD_OUT = "held out"


class QueryStyles(str, Enum):
    """Looks of the apartments to map."""

    TRAINING = "training"
    HELD_OUT = "held-out"
    BOTH = "both"


@app.command()
def planning(
    *,
    size: Annotated[
        list[int] | None, typer.Option(min=10, max=100, help="Metres; default 10, 20, 30 and 50.")
    ] = None,
    steps: Annotated[int, typer.Option(min=1, help="Planning steps to measure.")] = 40,
    as_json: Json = False,
) -> None:
    """How long a planning step takes, by the size of the building.

    A square building of rooms of 5 m, six in ten of them seen; the robot explores
    and drives towards its goal. Processor time, which other processes disturb
    less: of the median step, of the longest one in twenty, and the mean.
    """
    with cli_errors("planner"):
        from onemap_tools.bench.planning import SIZES_M, run

        result = run(tuple(size or SIZES_M), steps)
    if as_json:
        print_json(result)
    else:
        for row in result["results"]:
            print("  ".join(f"{name} {value}" for name, value in row.items()))


@app.command()
def perception(
    *,
    config: Config = None,
    random_weights: Annotated[
        bool, typer.Option("--random-weights", help="Measure backends without their weights.")
    ] = False,
    backend: Annotated[
        list[Backend] | None, typer.Option(help="With random weights; default: all.")
    ] = None,
    architecture: Annotated[
        str, typer.Option(help="Of openclip_convnext with random weights.")
    ] = "convnext_large_d_320",  # the paper's
    device: Annotated[
        list[str] | None, typer.Option(help="Default: cpu, and cuda if there is one.")
    ] = None,
    size: Annotated[str, typer.Option(help="Of the camera's image.")] = "640x480",
    frames: Frames = 30,
    threads: Annotated[
        int | None, typer.Option(min=1, help="CPU threads of torch; default: its own choice.")
    ] = None,
    as_json: Json = False,
) -> None:
    """How long an encoder takes for one frame, on CPU and GPU.

    A frame is an image of noise; resizing it, copying it, the network and copying
    the features back all count. On CUDA the network alone is timed with device
    events too. The weights of --random-weights need no download: the time does
    not depend on their values.
    """
    with cli_errors("openclip"):
        import torch

        from onemap_tools.bench import perception as bench

        if threads is not None:
            torch.set_num_threads(threads)
        params = bench.PerceptionBenchParams(
            frames=frames,
            size_px=bench.parse_size(size),
            architecture=architecture,
            devices=tuple(device or bench.available_devices()),
        )
        if random_weights:
            document = bench.run(tuple(each.value for each in backend or Backend), params)
        else:
            document = bench.run_configured(_encoder_params(config), params)
    raise typer.Exit(_report_results(document, as_json))


def _report_results(document: dict[str, Any], as_json: bool) -> int:
    """Print the measured backends; the exit code says whether all of them could be measured."""
    results = document["results"]
    if as_json:
        print_json(document)
    else:
        for result in results:
            print("  ".join(f"{name} {value}" for name, value in result.items()))
    return EXIT_FAILED if any("problem" in result for result in results) else EXIT_OK


@app.command()
def queries(
    *,
    config: Config = None,
    apartments: Annotated[
        int, typer.Option(min=2, max=100, help="Those with odd seeds choose the floor.")
    ] = 10,
    pictures: Annotated[int, typer.Option(min=1, help="Images of each apartment.")] = 40,
    style: Annotated[QueryStyles, typer.Option(help="Of the apartments.")] = QueryStyles.BOTH,
    threads: Threads = 1,
    as_json: Json = False,
) -> None:
    """Which scores mean something: the floor of an encoder and how often it errs.

    Generated apartments are mapped in this process from images of sampled poses.
    Every map is then queried for each class name of mini, each synonym that was
    never a training target (through its embedding), each alias, and words that
    name nothing there. An object is present if the map was shown it well enough
    and absent if the apartment has none; in between, the query does not count. An
    answer is right if its best region lies within 1 m of such an object.

    The floor, below which a map answers "nothing", is the lowest at which at most
    one unrelated word in twenty is answered. It is chosen on apartments with odd
    seeds; the rates are measured on those with even seeds.
    """
    with cli_errors("demo"):
        import torch

        from onemap_tools.bench import queries as bench
        from onemap_tools.bench.query_report import QueryBenchParams, table_lines

        torch.set_num_threads(threads)
        params = QueryBenchParams(
            seeds=bench.SEEDS[:apartments], styles=bench.STYLES[style.value], images=pictures
        )

        def report(done: int) -> None:
            typer.echo(f"{done} of {apartments} apartments", err=True)

        result = bench.run_configured(_encoder_params(config), params, report)
    if as_json:
        print_json(result)
    else:
        print("\n".join(table_lines(result)))


@app.command()
def scene(
    *,
    path: SceneOrRecording,
    labels: Labels = None,
    places: Places = 8,
    every: Annotated[int, typer.Option(min=1, help="Map every Nth frame of a recording only.")] = 1,
    out: SceneOut = None,
    config: Config = None,
    threads: Threads = 1,
    as_json: Json = False,
) -> None:
    """What an encoder sees in a scene of your own: right, wrong and missing answers.

    A recording is mapped from all of its frames, or those that --every leaves. A scene
    file is rendered with the simulator's camera, which stands at places spread over
    the floor that a robot can reach and turns all around in eight steps; no robot
    drives, and nothing is random.

    The map is then asked for the name of every label. A place is found if the centre
    of one of the answers lies in its circle (rank: of the first such). "here" and
    "elsewhere" are the highest scores of a cell in the circle, and outside of all
    circles of that name; "looks most like" is the other name, of mini's and of the
    labels, with the highest score in the circle. Without --labels, the named objects
    of a scene file are the labels.
    """
    with cli_errors("demo"):
        import torch

        from onemap_mapper.config import MapperConfig
        from onemap_perception.config import PerceptionConfig
        from onemap_shared.config import read, section
        from onemap_tools.bench import scene as bench
        from onemap_tools.bench.place_report import table_lines

        torch.set_num_threads(threads)
        sections = read(config)
        params = bench.SceneBenchParams(
            path,
            labels,
            places,
            every,
            out,
            ros2=sections.get("ros2", {}),
            perception=section(sections, "perception", PerceptionConfig),
            mapper=section(sections, "mapper", MapperConfig),
        )
        result = bench.run(params)
    if as_json:
        print_json(result)
    else:
        print("\n".join(table_lines(result)))


@app.command()
def navigation(
    *,
    method: MethodOption = Method.ONEMAP,
    features: FeaturesOption = Features.SIMULATED,
    errors: SimulatedErrors = Errors.NONE,
    stairwells: Stairwells = 0,
    episodes: Annotated[int, typer.Option(min=1, help="Apartments, one episode in each.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Of the first apartment.")] = 1,
    apartments: Parity = Apartments.ALL,
    style: Annotated[SearchStyle, typer.Option(help="Of the apartments.")] = SearchStyle.TRAINING,
    objects_per_episode: ObjectsPerEpisode = 3,
    order: Order = ObjectOrder.GIVEN,
    limit: Annotated[float, typer.Option(min=1, help="Simulated seconds per object.")] = 300.0,
    workers: Annotated[int, typer.Option(min=1, help="Episodes at once, a core each.")] = 1,
    out: ResultsFolder = None,
    beside: Beside = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """How well a method finds sequences of objects in generated apartments.

    Searches in simulated time, with the modules that the services run, each from
    a random start for objects that the seed draws from what the apartment has.
    The simulator's ground truth judges success as Habitat does; intervals are
    95 % bootstrap intervals. The same command gives the same result but for wall_s.
    """
    with cli_errors("demo"):
        from onemap_shared.messages import SearchOrder
        from onemap_tools.bench.navigation import benchmark
        from onemap_tools.bench.navigation.report import episode_line, table_lines

        options = benchmark.NavigationOptions(
            method=method,
            features=features,
            episodes=episodes,
            seed=seed,
            apartments=apartments,
            style=style.value,
            objects=objects_per_episode,
            limit_s=limit,
            config=config,
            order=SearchOrder(order.value),
            errors=errors,
            stairwells=stairwells,
        )
        result = benchmark.run_benchmark(
            options,
            workers=workers,
            out=out,
            report=lambda record: typer.echo(episode_line(record), err=True),
            beside=beside or (),
        )
    typer.echo("\n".join(table_lines(result)), err=as_json)
    if as_json:
        print_json(result)


def _encoder_params(config: Path | None) -> Any:
    from onemap_perception.config import PerceptionConfig
    from onemap_shared.config import load

    return load(config, "perception", PerceptionConfig)[2].encoder
