"""Metrics of navigation, each the ratio of two sums over episodes, with bootstrap intervals.

SR, SPL: Anderson et al. (2018), as Habitat's ObjectNav; of a sequence as in the paper: all objects
found, shortest paths summed from where the search for each began. PR: objects found before the
first failure over all; PPL: PR times shortest over driven path of the sequence until it ends there
(Wani et al., 2020). SPL by position: given that all objects before were found, as in the paper.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from onemap_shared.geometry import F64
from onemap_tools.bench.navigation.records import EpisodeRecord, Failure
from onemap_tools.demo.summary import path_efficiency

RESAMPLES = 2000  # the ends of a 95 % interval are then known to a tenth of its width
COVERAGE = (2.5, 97.5)  # percentiles


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value with its 95 % interval; None where there is nothing to count."""

    value: float | None
    low: float | None
    high: float | None

    def document(self) -> dict[str, float | None]:
        """As a JSON object."""
        return {"value": self.value, "low": self.low, "high": self.high}

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


def resampling_weights(episodes: int, seed: int) -> F64:
    """How often (RESAMPLES, episodes) each episode is in a sample drawn with replacement."""
    rng = np.random.default_rng(seed)
    weights: F64 = rng.multinomial(episodes, np.full(episodes, 1 / episodes), RESAMPLES).astype(
        np.float64
    )
    return weights


def estimate(values: F64, value: float) -> Estimate:
    """The value with the percentiles of its resampled values (R,), NaN left out."""
    values = values[np.isfinite(values)]
    if not np.isfinite(value) or len(values) == 0:
        return Estimate(None, None, None)
    low, high = np.percentile(values, COVERAGE)
    return Estimate(round(float(value), 4), round(float(low), 4), round(float(high), 4))


def estimates(episodes: Sequence[EpisodeRecord], seed: int) -> dict[str, Estimate]:
    """All metrics by name."""
    weights, once = resampling_weights(len(episodes), seed), np.ones((1, len(episodes)))
    ratios = ratios_of(episodes)
    found = {
        name: estimate(ratio.of(weights), float(ratio.of(once)[0]))
        for name, ratio in ratios.items()
    }
    first, third = ratios["spl_1"], ratios.get("spl_3")
    if third is not None:
        with np.errstate(divide="ignore", invalid="ignore"):
            resampled = third.of(weights) / first.of(weights)
            value = float((third.of(once) / first.of(once))[0])
        found["spl_third_over_first"] = estimate(resampled, value)
    return found


def summary(episodes: Sequence[EpisodeRecord], seed: int) -> dict[str, Any]:
    """Metrics with intervals, and counts of the reasons of failure, as a JSON object."""
    objects = [item for episode in episodes for item in episode.objects]
    reasons = Counter(item.failure.value for item in objects)
    return {
        "episodes": len(episodes),
        "objects": len(objects),
        "metrics": {name: each.document() for name, each in estimates(episodes, seed).items()},
        "failures": {reason.value: reasons[reason.value] for reason in Failure if reason.value},
        "timed_out": sum(item.timed_out for item in objects),
        "contacts": sum(episode.contacts for episode in episodes),
        "people_touched": sum(episode.people_touched for episode in episodes),
        "stairwells": sum(len(episode.stairwells) for episode in episodes),
        "edges_crossed": sum(episode.edges_crossed for episode in episodes),
        "frames_lost": sum(episode.frames_lost for episode in episodes),
        "pose_jumps": sum(episode.pose_jumps for episode in episodes),
        "pose_error_m": max(episode.pose_error_m for episode in episodes),
        "simulated_s": round(sum(episode.simulated_s for episode in episodes), 1),
    }


def ratios_of(episodes: Sequence[EpisodeRecord]) -> dict[str, Ratio]:
    """All metrics but ``spl_third_over_first`` by name."""
    ones = np.ones(len(episodes))
    counts = _column(episodes, lambda e: len(e.objects))
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
    ratios = {name: Ratio(_column(episodes, each), counts) for name, each in per_object.items()}
    ratios |= {name: Ratio(_column(episodes, each), ones) for name, each in per_episode.items()}
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


def _column(episodes: Sequence[EpisodeRecord], value: Callable[[EpisodeRecord], float]) -> F64:
    return np.array([float(value(episode)) for episode in episodes])
