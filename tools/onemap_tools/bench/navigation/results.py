"""What is kept of an episode, as one JSON object, and what is computed from many.

Each metric is the ratio of two sums over episodes, with a bootstrap interval. SR, SPL: Anderson et
al. (2018), as Habitat's ObjectNav; of a sequence as in the paper: all objects found, shortest paths
summed from where the search for each began. PR: objects found before the first failure over all;
PPL: PR times shortest over driven path of the sequence until it ends there (Wani et al., 2020). SPL
by position: given that all objects before were found, as in the paper.

The folder of a run holds options, episodes and summary. A run that was killed goes on where
it stopped; a last line that was cut off is run again.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from onemap_shared.geometry import F64
from onemap_tools.judgement import path_efficiency

DIGITS, TRAJECTORY_DIGITS = 4, 2
STARTED_S = 15.0  # seconds in which a look around takes half: a robot that sets out has driven 3 m
RESAMPLES = 2000  # the ends of a 95 % interval are then known to a tenth of its width
COVERAGE = (2.5, 97.5)  # percentiles
# Compared by quotients:
RATIOS = ("spl", "sequence_spl", "spl_1", "spl_2", "spl_3", "path_m", "time_s")
DIFFERENCES = ("sr", "wrong_claims")


class Failure(str, Enum):
    """Why an object was not found; the first that applies."""

    NONE = ""
    WRONG_OBJECT = "wrong object claimed"
    STOPPED_SHORT = "stopped out of reach or sight"
    STUCK = "the search failed"
    NEVER_IN_VIEW = "never in view"
    NOT_DETECTED = "in view, not detected"
    NOT_ACCEPTED = "detected, not accepted"
    FOUND_OTHER = "said: only another one of its kind"


@dataclass(frozen=True, slots=True)
class ObjectRecord:
    """The search for one object. Lengths in metres: driven, shortest, and along the floor from
    where it stopped to the nearest success place; None where there is no path.

    in_view, detected: frames that showed it large enough, and in which it was detected.
    """

    name: str
    outcome: str
    reason: str
    success: bool
    claimed_wrongly: bool
    spl: float
    path_length_m: float
    shortest_path_m: float | None
    goal_distance_m: float | None
    time_s: float
    in_view: int
    detected: int
    failure: Failure
    timed_out: bool = False


@dataclass(frozen=True, slots=True)
class EpisodeRecord:
    """One episode. start: x, y, yaw; trajectory: true positions in metres, one per frame;
    contacts: above 0.05 m/s, counted by the simulator, people_touched of them with people;
    pose_error_m: the largest of the reported pose; wall_s and planning_p50_ms, planning_p95_ms, the
    processor time of a planning step, are all that differs between two runs; scene: where it ran,
    empty for the apartment of the seed; stairwells: x_min, y_min, x_max, y_max in metres of
    openings in the floor, edges_crossed: how often the robot came over one; start_m: metres driven
    in the first ``STARTED_S``; phrase: of the object that is meant where others are of its kind;
    zones: keep-out rectangles, as stairwells; in_zone_m: how far the robot's disc reached into one
    at most; room_ious: of the map's rooms with the true ones that were seen."""

    index: int
    seed: int
    start: tuple[float, float, float]
    objects: tuple[ObjectRecord, ...] = ()
    contacts: int = 0
    simulated_s: float = 0.0
    trajectory: tuple[tuple[float, float], ...] = ()
    wall_s: float = 0.0
    scene: str = ""
    people_touched: int = 0
    frames_lost: int = 0
    pose_jumps: int = 0
    pose_error_m: float = 0.0
    stairwells: tuple[tuple[float, float, float, float], ...] = ()
    edges_crossed: int = 0
    start_m: float = 0.0
    phrase: str = ""
    zones: tuple[tuple[float, float, float, float], ...] = ()
    in_zone_m: float = 0.0
    room_ious: tuple[float, ...] = ()
    planning_p50_ms: float = 0.0
    planning_p95_ms: float = 0.0

    @property
    def progress(self) -> int:
        """Objects found before the first that was not."""
        failed = (k for k, item in enumerate(self.objects) if not item.success)
        return next(failed, len(self.objects))

    def document(self) -> dict[str, Any]:
        """As a JSON object, lengths and times rounded."""
        fields: dict[str, Any] = EPISODE.dump_python(self, mode="json")
        return {
            name: _rounded(value, TRAJECTORY_DIGITS if name == "trajectory" else DIGITS)
            for name, value in fields.items()
        }


EPISODE, OBJECT = TypeAdapter(EpisodeRecord), TypeAdapter(ObjectRecord)


def _rounded(value: Any, digits: int) -> Any:
    if isinstance(value, list):
        return [_rounded(each, digits) for each in value]
    if isinstance(value, dict):
        return {name: _rounded(each, digits) for name, each in value.items()}
    return round(value, digits) if isinstance(value, float) else value


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value with its 95 % interval; None where there is nothing to count."""

    value: float | None
    low: float | None
    high: float | None

    @classmethod
    def of(cls, values: F64) -> Estimate:
        """The first of the values (1 + R,), and percentiles of the others, NaN left out."""
        resampled = values[1:][np.isfinite(values[1:])]
        if not np.isfinite(values[0]) or len(resampled) == 0:
            return cls(None, None, None)
        low, high = np.percentile(resampled, COVERAGE)
        return cls(*(round(float(each), 4) for each in (values[0], low, high)))

    def __str__(self) -> str:
        if self.value is None or self.low is None or self.high is None:
            return "-"
        return f"{self.value:.3f} [{self.low:.3f}, {self.high:.3f}]"


def resampling(episodes: int, seed: int) -> F64:
    """How often each episode counts (1 + RESAMPLES, episodes): once, then drawn with
    replacement."""
    rng = np.random.default_rng(seed)
    drawn = rng.multinomial(episodes, np.full(episodes, 1 / episodes), RESAMPLES)
    return np.vstack([np.ones(episodes), drawn])


def metrics_of(episodes: Sequence[EpisodeRecord], weights: F64) -> dict[str, F64]:
    """All metrics by name: quotients (R,) of sums with weights (R, episodes), NaN over 0."""

    def column(value: Callable[[EpisodeRecord], float]) -> F64:
        return np.array([float(value(episode)) for episode in episodes])

    def of_position(k: int) -> tuple[F64, F64]:
        reached = [k < len(e.objects) and e.progress >= k for e in episodes]
        spl = [
            e.objects[k].spl if there else 0.0 for e, there in zip(episodes, reached, strict=True)
        ]
        return np.array(spl), np.array(reached, np.float64)

    objects, once = column(lambda e: len(e.objects)), np.ones(len(episodes))
    sums: dict[str, tuple[F64, F64]] = {
        "sr": (column(lambda e: sum(item.success for item in e.objects)), objects),
        "spl": (column(lambda e: sum(item.spl for item in e.objects)), objects),
        "wrong_claims": (column(lambda e: sum(i.claimed_wrongly for i in e.objects)), objects),
        "path_m": (column(lambda e: sum(item.path_length_m for item in e.objects)), objects),
        "time_s": (column(lambda e: sum(item.time_s for item in e.objects)), objects),
        "sequence_sr": (column(lambda e: e.progress == len(e.objects)), once),
        "sequence_spl": (column(sequence_spl), once),
        "pr": (column(lambda e: e.progress / len(e.objects)), once),
        "ppl": (column(progress_by_path_length), once),
        "contacts": (column(lambda e: e.contacts), once),
        "start_m": (column(lambda e: e.start_m), once),
    }
    for k in range(max(len(episode.objects) for episode in episodes)):
        sums[f"spl_{k + 1}"] = of_position(k)
    found = {name: _quotient(weights @ a, weights @ b) for name, (a, b) in sums.items()}
    if "spl_3" in found:
        found["spl_third_over_first"] = _quotient(found["spl_3"], found["spl_1"])
    return found


def _quotient(above: F64, below: F64) -> F64:
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient: F64 = above / below
    return quotient


def sequence_spl(episode: EpisodeRecord) -> float:
    """Summed shortest paths over the path driven; 0 unless all objects were found."""
    complete = episode.progress == len(episode.objects)
    return _efficiency(episode, len(episode.objects)) if complete else 0.0


def progress_by_path_length(episode: EpisodeRecord) -> float:
    """PPL: the path counts up to the end of the first search that failed."""
    share = episode.progress / len(episode.objects)
    return share * _efficiency(episode, episode.progress + 1) if share > 0 else 0.0


def _efficiency(episode: EpisodeRecord, driven: int) -> float:
    """Shortest paths to the objects of the progress over the path of the first ``driven``."""
    shortest = sum(item.shortest_path_m or 0.0 for item in episode.objects[: episode.progress])
    return path_efficiency(shortest, sum(i.path_length_m for i in episode.objects[:driven]))


def estimates(episodes: Sequence[EpisodeRecord], seed: int) -> dict[str, Any]:
    """All metrics by name, each as the fields of an ``Estimate``."""
    found = metrics_of(episodes, resampling(len(episodes), seed))
    return {name: asdict(Estimate.of(values)) for name, values in found.items()}


def comparison(
    own: Sequence[EpisodeRecord], other: Sequence[EpisodeRecord], seed: int
) -> dict[str, Any]:
    """Own over other for ``RATIOS``, own less other for ``DIFFERENCES``, as ``estimates``.

    Both on the apartments that both searched, resampled together; ValueError if there are none.
    """
    first, second = ({each.seed: each for each in episodes} for episodes in (own, other))
    common = sorted(first.keys() & second.keys())
    if not common:
        raise ValueError("the runs have no apartment in common: compare runs of the same seeds")
    weights = resampling(len(common), seed)
    mine, theirs = (metrics_of([each[k] for k in common], weights) for each in (first, second))
    return {
        name: asdict(
            Estimate.of(
                _quotient(mine[name], theirs[name]) if name in RATIOS else mine[name] - theirs[name]
            )
        )
        for name in (*RATIOS, *DIFFERENCES)
        if name in mine
    }


def summary(episodes: Sequence[EpisodeRecord], seed: int) -> dict[str, Any]:
    """Metrics with intervals, and counts of the reasons of failure, as a JSON object."""
    objects = [item for episode in episodes for item in episode.objects]
    ious = [iou for episode in episodes for iou in episode.room_ious]
    reasons = Counter(item.failure for item in objects)
    counted = ("contacts", "people_touched", "edges_crossed", "frames_lost", "pose_jumps")
    return {
        "episodes": len(episodes),
        "objects": len(objects),
        "metrics": estimates(episodes, seed),
        "failures": {reason.value: reasons[reason] for reason in Failure if reason.value},
        "timed_out": sum(item.timed_out for item in objects),
        "stairwells": sum(len(episode.stairwells) for episode in episodes),
        **{name: sum(getattr(episode, name) for episode in episodes) for name in counted},
        "pose_error_m": max(episode.pose_error_m for episode in episodes),
        "zones": sum(len(episode.zones) for episode in episodes),
        "in_zone_m": max(episode.in_zone_m for episode in episodes),
        "simulated_s": round(sum(episode.simulated_s for episode in episodes), 1),
        "rooms": len(ious),
        "rooms_iou": round(float(np.mean(ious)), 3) if ious else None,
        **{
            name: round(float(np.mean([getattr(e, name) for e in episodes])), 1)
            for name in ("planning_p50_ms", "planning_p95_ms")
        },
    }


OPTIONS_FILE, EPISODES_FILE = "options.json", "episodes.jsonl"
RESULTS_FILE = "results.json"
# Settings of the search itself; those of simulator and perception are part of the task.
SEARCHING = ("config.planner.", "config.mapper.", "latency.")
# What may differ beside them: the apartments that both searched are compared.
FREE = {"method", "episodes", "seed", "config.simulator.seed", "apartments"}
FREE |= {"link", "delay", "jitter"}


def episode_line(episode: EpisodeRecord) -> str:
    """One episode as a line of text."""
    objects = "; ".join(_object(item) for item in episode.objects)
    where = episode.scene or f"apartment {episode.seed}"
    return f"{where}, {episode.simulated_s:.0f} s: {objects}"


def _object(item: ObjectRecord) -> str:
    if item.success:
        return f"{item.name} found, SPL {item.spl:.2f} over {item.path_length_m:.1f} m"
    return f"{item.name}: {item.failure.value}{' (time)' if item.timed_out else ''}"


def table_lines(result: Mapping[str, Any]) -> list[str]:
    """All values of the JSON object by its names: single ones, failures, metrics, comparisons."""
    rows: dict[str, object] = {
        name: each for name, each in result.items() if isinstance(each, (str, int, float))
    }
    rows |= {f"failed: {name}": count for name, count in result["failures"].items()}
    rows |= {name: Estimate(**values) for name, values in result["metrics"].items()}
    for method, other in result["compared_with"].items():
        for name, values in other["compared"].items():
            how = "less" if name in DIFFERENCES else "over"
            rows[f"{name} {how} that of {method}"] = Estimate(**values)
    width = max(map(len, rows))
    return [f"{name:{width}} {value}" for name, value in rows.items()]


class ResultsFolder:
    """Opens or creates the folder; ValueError if it holds results of other options."""

    def __init__(self, folder: Path, options: Mapping[str, Any]) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / OPTIONS_FILE
        wanted = json.loads(json.dumps(options))
        if file.exists():
            differing = _differing(_options(file), wanted)
            _refuse(folder, differing, "choose another folder for --out")
        else:
            file.write_text(json.dumps(wanted, indent=2) + "\n", encoding="utf-8")
        self._episodes = folder / EPISODES_FILE
        self.finished = _finished(self._episodes)
        self._episodes.write_text("".join(map(_line, self.finished)), encoding="utf-8")

    def add(self, record: EpisodeRecord) -> None:
        """Keep a finished episode."""
        with self._episodes.open("a", encoding="utf-8") as file:
            file.write(_line(record))

    def write_results(self, document: Mapping[str, Any]) -> None:
        """Write the summary."""
        text = json.dumps(document, indent=2) + "\n"
        (self.folder / RESULTS_FILE).write_text(text, encoding="utf-8")


def read_beside(folder: Path, options: Mapping[str, Any]) -> tuple[str, list[EpisodeRecord]]:
    """Name and episodes of another run: its method, and its settings where they differ.

    ValueError if more differs than method, apartments and the settings of ``SEARCHING``:
    then the task was another one.
    """
    file = folder / OPTIONS_FILE
    if not file.exists():
        raise ValueError(f"{folder} holds no results of onemap bench navigation")
    before = _options(file)
    differing = _differing(before, options)
    settings = [name for name in differing if name.startswith(SEARCHING)]
    another = {k: each for k, each in differing.items() if k not in {*FREE, *settings}}
    advice = "only runs that differ in method, planner or mapper can be compared"
    _refuse(folder, another, advice)
    of = [f"{name.removeprefix('config.')} {differing[name][0]!r}" for name in settings]
    name = ", ".join((str(before["method"]), *of))
    return name, _finished(folder / EPISODES_FILE)


def _refuse(folder: Path, differing: Mapping[str, tuple[Any, Any]], advice: str) -> None:
    if differing:
        named = [f"{name} {had!r} instead of {want!r}" for name, (had, want) in differing.items()]
        raise ValueError(f"{folder} holds results with {', '.join(named)}: {advice}")


def _differing(before: Mapping[str, Any], wanted: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Both values of each option in which the two differ, by its dotted name."""
    had, want = _flat(before), _flat(wanted)
    names = dict.fromkeys((*had, *want))
    both = {name: (had.get(name), want.get(name)) for name in names}
    return {name: (one, other) for name, (one, other) in both.items() if one != other}


def _flat(document: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """The document's values by dotted names."""
    values: dict[str, Any] = {}
    for name, value in document.items():
        inner = _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else None
        values |= {f"{prefix}{name}": value} if inner is None else inner
    return values


def _options(file: Path) -> Mapping[str, Any]:
    try:
        options = json.loads(file.read_text(encoding="utf-8"))
    except ValueError:
        options = None
    if not isinstance(options, dict):
        raise ValueError(f"{file} is damaged: choose another folder for --out")
    return options


def _finished(file: Path) -> list[EpisodeRecord]:
    """The episodes of the file; a line that is not one, cut off by a kill, is left out."""
    records = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            record = EPISODE.validate_json(line)
        except ValueError:
            continue
        records[record.index] = record
    return list(records.values())


def _line(record: EpisodeRecord) -> str:
    return json.dumps(record.document(), allow_nan=False) + "\n"
