"""What a network was trained with, kept in its checkpoint and beside its weights."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

TRAINING_FILE = "training.json"  # beside the weights


@dataclass(frozen=True, slots=True)
class TrainingRound:
    """One run of the trainer.

    frozen_stride: what computes at it or before was not trained; 0 if all was.
    """

    steps: int
    seed: int
    pictures: int
    apartments: int
    frozen_stride: int


Rounds = tuple[TrainingRound, ...]


def dump_rounds(rounds: Sequence[TrainingRound]) -> str:
    """The rounds as JSON, first to last."""
    return json.dumps({"rounds": [asdict(one) for one in rounds]})


def parse_rounds(text: str) -> Rounds:
    """The rounds of ``dump_rounds``; ValueError if the text is something else."""
    try:
        return tuple(TrainingRound(**one) for one in json.loads(text)["rounds"])
    except (KeyError, TypeError) as problem:
        raise ValueError(f"not a list of training rounds: {problem}") from problem


def write_rounds(folder: Path, rounds: Sequence[TrainingRound]) -> None:
    """Write ``training.json``."""
    (folder / TRAINING_FILE).write_text(dump_rounds(rounds) + "\n", encoding="utf-8")


def read_rounds(folder: Path) -> Rounds:
    """What the weights in this folder were trained with; empty where that was not written down."""
    try:
        return parse_rounds((folder / TRAINING_FILE).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return ()
    except ValueError as problem:
        raise ValueError(f"{folder / TRAINING_FILE}: {problem}") from problem


def difference(stored: TrainingRound, asked: TrainingRound) -> str:
    """In words, what differs: "steps 7500 rather than 5000, seed 0 rather than 1"."""
    pairs = [(name, value, asdict(asked)[name]) for name, value in asdict(stored).items()]
    return ", ".join(
        f"{name.replace('_', ' ')} {old} rather than {new}"
        for name, old, new in pairs
        if old != new
    )
