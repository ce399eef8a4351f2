"""The options of every benchmark: one frozen class each, its fields are the command's options.

``module`` of ``onemap_tools.bench`` measures: it has ``run(options, tell)``, which returns the
result as a JSON object, and may have ``lines(result)`` for people. ``extra`` installs what it
needs. Nothing heavy is imported here: the command line reads this file at every start.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from typer import Option

from onemap_tools.cli.options import Config, Json

Device = Annotated[str, Option(help="cpu, cuda or cuda:N, as mapper.device.")]
Threads = Annotated[int, Option(min=1, help="CPU threads of torch.")]
Frames = Annotated[int, Option(min=1, help="Frames to measure.")]
Seed = Annotated[int, Option(min=0, help="Of the features.")]
Limit = Annotated[float, Option(min=1, help="Simulated seconds per object.")]

MethodName = Literal[
    "onemap",
    "onemap_reset",
    "onemap_no_consensus",
    "vlfm",
    "nearest_frontier",
    "oracle",
]
FeaturesName = Literal["simulated", "uncalibrated", "mini"]
ErrorsName = Literal["none", "drift", "jump", "late", "dropped", "depth", "people", "all"]
Parity = Literal["all", "even", "odd"]
GoalsName = Literal["names", "relations", "rooms", "colours"]

Method = Annotated[MethodName, Option(help="Of searching.")]


@dataclass(frozen=True, kw_only=True)
class Options:
    """What all benchmarks have."""

    module: ClassVar[str]
    extra: ClassVar[str] = "demo"
    as_json: Json = False


@dataclass(frozen=True, kw_only=True)
class FusionBench(Options):
    """How long the map takes to fuse one frame.

    Timed per frame: projection, blur, fusion and occupancy of a 640 x 480 field
    with 24 x 24 x 768 features. The variance is perception's work and the
    decoding the bus's; both are done beforehand. The room is simulated, the
    features are random. cpu_p50_ms and cpu_min_ms are the processor time of a
    frame, which other processes disturb less. With --device cuda features are
    fused on the GPU; all other times are of the clock, read when the GPU is done.
    """

    module = "fusion"
    extra = "mapper"
    frames: Frames = 50
    device: Device = "cpu"
    threads: Threads = 1
    seed: Seed = 0


@dataclass(frozen=True, kw_only=True)
class QueryBench(Options):
    """How long a text query over a large map takes, inside the mapper.

    Random features of 768 channels. read_ms is reading the table once, and
    matrix_product_ms what the machine's own rate for large matrices would take for
    32 texts, both measured in this run. product_ms: the scalar products of one text
    alone, where the features are. A text competes with 103 neutral words, whose part
    is computed with the first text (first_text_ms) and kept.
    standing_ms_per_frame: 20 texts asked again after a frame changed 800 cells. Processor
    time with one thread, the best of several runs. With --device cuda the features are
    on the GPU, and the times are of the clock, read when the GPU is done.
    """

    module = "query"
    extra = "mapper"
    cells: Annotated[int, Option(min=4096, help="Of the map.")] = 250_000
    feature_dtype: Annotated[
        Literal["float32", "float16"], Option(help="Of the stored features.")
    ] = "float32"
    device: Device = "cpu"
    threads: Threads = 1
    seed: Seed = 0


@dataclass(frozen=True, kw_only=True)
class NavigationBench(Options):
    """How well a method finds sequences of objects in generated apartments.

    Searches of the services themselves, in virtual time, each from a random start
    for objects that the seed draws from what the apartment has.
    The simulator's ground truth judges success as Habitat does; intervals are
    95 % bootstrap intervals. The same command gives the same result but for wall_s.
    """

    module = "navigation.benchmark"
    method: Method = "onemap"
    features: Annotated[
        FeaturesName, Option(help="uncalibrated: simulated, with scores as CLIP's.")
    ] = "simulated"
    errors: Annotated[
        ErrorsName, Option(help="Of a real robot; jump: drift that loop closures set right.")
    ] = "none"
    stairwells: Annotated[
        int, Option(min=0, max=4, help="Openings in each apartment's floor, on the ways to take.")
    ] = 0
    zones: Annotated[
        int, Option(min=0, max=4, help="Keep-out zones in each: rooms, and floor on the ways.")
    ] = 0
    episodes: Annotated[int, Option(min=1, help="Apartments, one episode in each.")] = 10
    seed: Annotated[int, Option(min=0, help="Of the first apartment.")] = 1
    apartments: Annotated[Parity, Option(help="Settings are chosen on even seeds.")] = "all"
    goals: Annotated[
        GoalsName,
        Option(
            help="names: kinds of object; others: in each apartment one object of several of its "
            "kind, as 'lamp next to the bed'."
        ),
    ] = "names"
    objects_per_episode: Annotated[
        int, Option(min=1, max=10, help="Objects, one after the other, of --goals names.")
    ] = 3
    limit: Limit = 300.0
    latency: Annotated[
        Path | None,
        Option(
            exists=True,
            dir_okay=False,
            help="How long encoding, detecting, fusing and planning take: a result of "
            "'onemap bench system --json'. Without it: no time.",
        ),
    ] = None
    link: Annotated[
        float, Option(min=0, help="Mbit/s each way between perception and router; 0: no limit.")
    ] = 0.0
    delay: Annotated[float, Option(min=0, help="Of the link, milliseconds each way.")] = 0.0
    jitter: Annotated[float, Option(min=0, help="Milliseconds that come to it, at most.")] = 0.0
    workers: Annotated[int, Option(min=1, help="Episodes at once, a core each.")] = 1
    out: Annotated[
        Path | None, Option(help="Folder of the results; a killed run goes on there.")
    ] = None
    beside: Annotated[
        list[Path] | None,
        Option(help="Results of another method, or of other settings, to compare with."),
    ] = None
    planning: Annotated[
        float,
        Option(
            min=0,
            max=200,
            help="Metres: no search, but the time of planning steps in a drawn building of this "
            "side.",
        ),
    ] = 0.0
    config: Config = None


@dataclass(frozen=True, kw_only=True)
class FaultsBench(Options):
    """Search for faults by seed: services killed, stalled, cut off, clocks set, and what must hold.

    Each seed draws an apartment, searches, what a user does and what fails, and runs the real
    services in virtual time. Of a rule that does not hold it prints the seed, and the smallest plan
    that still breaks it. The same seed gives the same run.
    """

    module = "faults.benchmark"
    seeds: Annotated[int, Option(min=1, help="How many.")] = 10
    seed: Annotated[int, Option(min=0, help="The first.")] = 1
    workers: Annotated[int, Option(min=1, help="Seeds at once, a core each.")] = 1


@dataclass(frozen=True, kw_only=True)
class HabitatBench(Options):
    """The paper's figures on HM3D, in Habitat: SR, SPL, PR, PPL, SPL by position.

    Needs Habitat-Sim and the HM3D scenes with their annotations; docs/benchmarks.md
    says what to install. Searches in simulated time; the folder holds results.json and
    one line per episode. It has never been run on the real data: its tests
    drive a stand-in for Habitat.
    """

    module = "habitat.benchmark"
    episodes: Annotated[
        Path, Option(help="Split of ObjectNav, or the paper's folder of multi-object ones.")
    ]
    scenes: Annotated[Path, Option(help="Folder in which hm3d or hm3d_v0.2 lies.")]
    out: Annotated[Path, Option(help="Folder of the results; a killed run goes on there.")]
    goals: Annotated[
        Path | None, Option(help="ObjectNav of the same scenes, for multi-object episodes.")
    ] = None
    count: Annotated[int | None, Option(min=1, help="Only the first; default: all.")] = None
    method: Method = "onemap"
    limit: Limit = 300.0
    config: Config = None


@dataclass(frozen=True, kw_only=True)
class SystemBench(Options):
    """Where a frame's time goes, process by process, and what one machine carries.

    Starts the real processes. One robot sends recorded frames to perception, and the
    planner searches. Several share one map: they send recorded fields of mini beside
    their frames, so that nothing encodes images. Recorded robots turn on their places
    in a generated apartment and obey no command. --config says the encoder, and
    bus.link of robots and perception.

    taken: age of a frame when a process took it, what it waited for and the way
    included; stage: from there until the next process has the result. user, kernel
    and wakes (voluntary context switches) count per fused frame; computing is what a
    service reports of its own step.
    """

    module = "system"
    robots: Annotated[int, Option(min=1, max=16, help="With one map.")] = 1
    rate: Annotated[float, Option(min=0.1, max=60, help="Frames per second of each.")] = 15.0
    size: Annotated[str, Option(help="Of the camera's image.")] = "320x240"
    seconds: Annotated[float, Option(min=1, help="That count.")] = 10.0
    config: Config = None


BENCHMARKS: tuple[type[Options], ...] = (
    NavigationBench,
    FaultsBench,
    FusionBench,
    QueryBench,
    SystemBench,
    HabitatBench,
)
