"""What is kept of an episode, as one JSON object, and what is computed from many.

Each metric is the ratio of two sums over episodes, with a bootstrap interval. SR, SPL: Anderson et
al. (2018), as Habitat's ObjectNav; of a sequence as in the paper: all objects found, shortest paths
summed from where the search for each began. PR: objects found before the first failure over all;
PPL: PR times shortest over driven path of the sequence until it ends there (Wani et al., 2020). SPL
by position: given that all objects before were found, as in the paper.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from onemap_shared.geometry import F64
from onemap_tools.demo.summary import path_efficiency

DIGITS, TRAJECTORY_DIGITS = 4, 2
RESAMPLES = 2000  # the ends of a 95 % interval are then known to a tenth of its width
COVERAGE = (2.5, 97.5)  # percentiles
RATIOS = ("spl", "sequence_spl", "spl_1", "spl_2", "spl_3", "path_m")  # compared by quotients
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
    pose_error_m: the largest of the reported pose; wall_s is the only value that differs between
    two runs; scene: where it ran, empty for the apartment of the seed; stairwells: x_min, y_min,
    x_max, y_max in metres of openings in the floor, edges_crossed: how often the robot came over
    one."""

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
        "simulated_s": round(sum(episode.simulated_s for episode in episodes), 1),
    }
