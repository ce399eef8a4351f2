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

from onemap_shared.geometry import F64
from onemap_tools.demo.summary import json_value, path_efficiency

TRAJECTORY_DIGITS = 2  # centimetres
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
    objects: tuple[ObjectRecord, ...]
    contacts: int
    simulated_s: float
    trajectory: tuple[tuple[float, float], ...]
    wall_s: float
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
        """As a JSON object."""
        fields = asdict(self)
        fields["objects"] = [
            {**{key: json_value(value) for key, value in item.items()}, "failure": kept.failure}
            for item, kept in zip(fields["objects"], self.objects, strict=True)
        ]
        fields["trajectory"] = [
            [round(x, TRAJECTORY_DIGITS), round(y, TRAJECTORY_DIGITS)] for x, y in self.trajectory
        ]
        return {name: json_value(value) for name, value in fields.items()}


def episode_record(document: dict[str, Any]) -> EpisodeRecord:
    """The record of a JSON object; raises ValueError, KeyError or TypeError if it is not one."""
    objects = tuple(
        ObjectRecord(**{**item, "failure": Failure(item["failure"])})
        for item in document["objects"]
    )
    x, y, yaw = document["start"]
    trajectory = tuple((float(a), float(b)) for a, b in document["trajectory"])
    known = {"objects": objects, "start": (x, y, yaw), "trajectory": trajectory}
    stairwells = tuple(tuple(map(float, corners)) for corners in document.get("stairwells", ()))
    return EpisodeRecord(**{**document, **known, "stairwells": stairwells})


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value with its 95 % interval; None where there is nothing to count."""

    value: float | None
    low: float | None
    high: float | None

    @classmethod
    def of(cls, resampled: F64, value: float) -> Estimate:
        """The value with the percentiles of its resampled values (R,), NaN left out."""
        resampled = resampled[np.isfinite(resampled)]
        if not np.isfinite(value) or len(resampled) == 0:
            return cls(None, None, None)
        low, high = np.percentile(resampled, COVERAGE)
        return cls(round(float(value), 4), round(float(low), 4), round(float(high), 4))

    def __str__(self) -> str:
        if self.value is None or self.low is None or self.high is None:
            return "-"
        return f"{self.value:.3f} [{self.low:.3f}, {self.high:.3f}]"


@dataclass(frozen=True, slots=True)
class Ratio:
    """Sums whose quotient is the metric: numerator and denominator (episodes,)."""

    numerator: F64
    denominator: F64

    def of(self, weights: F64) -> F64:
        """The quotients (R,) for weights (R, episodes); NaN where the denominator is 0."""
        below = weights @ self.denominator
        quotient: F64 = np.divide(
            weights @ self.numerator, below, out=np.full(len(below), np.nan), where=below > 0
        )
        return quotient


def ratios_of(episodes: Sequence[EpisodeRecord]) -> dict[str, Ratio]:
    """All metrics but ``spl_third_over_first`` by name."""

    def column(value: Callable[[EpisodeRecord], float]) -> F64:
        return np.array([float(value(episode)) for episode in episodes])

    ones, counts = np.ones(len(episodes)), column(lambda e: len(e.objects))
    per_object: dict[str, Callable[[EpisodeRecord], float]] = {
        "sr": lambda e: sum(item.success for item in e.objects),
        "spl": lambda e: sum(item.spl for item in e.objects),
        "wrong_claims": lambda e: sum(item.claimed_wrongly for item in e.objects),
        "path_m": lambda e: sum(item.path_length_m for item in e.objects),
        "time_s": lambda e: sum(item.time_s for item in e.objects),
    }
    per_episode: dict[str, Callable[[EpisodeRecord], float]] = {
        "sequence_sr": lambda e: e.progress == len(e.objects),
        "sequence_spl": sequence_spl,
        "pr": lambda e: e.progress / len(e.objects),
        "ppl": progress_by_path_length,
        "contacts": lambda e: e.contacts,
    }
    ratios = {name: Ratio(column(each), counts) for name, each in per_object.items()}
    ratios |= {name: Ratio(column(each), ones) for name, each in per_episode.items()}
    for k in range(max(len(episode.objects) for episode in episodes)):
        sought = np.array([float(k < len(e.objects) and e.progress >= k) for e in episodes])
        spl = [e.objects[k].spl if k < len(e.objects) and e.progress >= k else 0 for e in episodes]
        ratios[f"spl_{k + 1}"] = Ratio(np.array(spl, np.float64), sought)
    return ratios


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


def _weights(episodes: int, seed: int) -> tuple[F64, F64]:
    """How often (RESAMPLES, episodes) each is in a sample drawn with replacement; and once each."""
    rng = np.random.default_rng(seed)
    drawn = rng.multinomial(episodes, np.full(episodes, 1 / episodes), RESAMPLES)
    return drawn.astype(np.float64), np.ones((1, episodes))


def estimates(episodes: Sequence[EpisodeRecord], seed: int) -> dict[str, Estimate]:
    """All metrics by name."""
    weights, once = _weights(len(episodes), seed)
    ratios = ratios_of(episodes)
    found = {
        name: Estimate.of(ratio.of(weights), float(ratio.of(once)[0]))
        for name, ratio in ratios.items()
    }
    if (third := ratios.get("spl_3")) is not None:
        both = [_quotient(third.of(each), ratios["spl_1"].of(each)) for each in (weights, once)]
        found["spl_third_over_first"] = Estimate.of(both[0], float(both[1][0]))
    return found


def comparison(
    own: Sequence[EpisodeRecord], other: Sequence[EpisodeRecord], seed: int
) -> dict[str, Estimate]:
    """Own over other for ``RATIOS``, own less other for ``DIFFERENCES``, by name.

    Both on the apartments that both searched, resampled together; ValueError if there are none.
    """
    first, second = ({each.seed: each for each in episodes} for episodes in (own, other))
    common = sorted(first.keys() & second.keys())
    if not common:
        raise ValueError("the runs have no apartment in common: compare runs of the same seeds")
    weights, once = _weights(len(common), seed)
    mine = ratios_of([first[apartment] for apartment in common])
    theirs = ratios_of([second[apartment] for apartment in common])
    found = {}
    for name in (*RATIOS, *DIFFERENCES):
        if name in mine:
            compare = _quotient if name in RATIOS else np.subtract
            both = [compare(mine[name].of(each), theirs[name].of(each)) for each in (weights, once)]
            found[name] = Estimate.of(both[0], float(both[1][0]))
    return found


def _quotient(above: F64, below: F64) -> F64:
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient: F64 = above / below
    return quotient


def summary(episodes: Sequence[EpisodeRecord], seed: int) -> dict[str, Any]:
    """Metrics with intervals, and counts of the reasons of failure, as a JSON object."""
    objects = [item for episode in episodes for item in episode.objects]
    reasons = Counter(item.failure.value for item in objects)
    counted = ("contacts", "people_touched", "edges_crossed", "frames_lost", "pose_jumps")
    return {
        "episodes": len(episodes),
        "objects": len(objects),
        "metrics": {name: asdict(each) for name, each in estimates(episodes, seed).items()},
        "failures": {reason.value: reasons[reason.value] for reason in Failure if reason.value},
        "timed_out": sum(item.timed_out for item in objects),
        "stairwells": sum(len(episode.stairwells) for episode in episodes),
        **{name: sum(getattr(episode, name) for episode in episodes) for name in counted},
        "pose_error_m": max(episode.pose_error_m for episode in episodes),
        "simulated_s": round(sum(episode.simulated_s for episode in episodes), 1),
    }
