"""The classes that ``mini`` was trained on, words it is evaluated with, and its calibration."""
# Touches files: vocabulary, calibration.

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

VOCABULARY_FILE = "vocabulary.json"


@dataclass(frozen=True, slots=True)
class ObjectClass:
    """One trained class. ``aliases`` (the name among them): training targets; ``held_out``:
    synonyms for evaluation only; ``query_aliases``: names whose embedding is known to fail, a
    query with one is answered as the class."""

    name: str
    aliases: tuple[str, ...]
    held_out: tuple[str, ...]
    query_aliases: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """Classes, unrelated nouns (``neutral``) and further nouns with a shipped embedding.

    ``prompt`` holds ``{}``; training and query use the same one.
    """

    prompt: str
    classes: tuple[ObjectClass, ...]
    neutral: tuple[str, ...]
    common: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Class names in the order of the training labels."""
        return tuple(entry.name for entry in self.classes)

    @property
    def words(self) -> tuple[str, ...]:
        """Every word, sorted, without repeats."""
        known = {word for entry in self.classes for word in (*entry.aliases, *entry.held_out)}
        return tuple(sorted(known | set(self.neutral) | set(self.common)))

    def class_of(self, word: str) -> int | None:
        """Index of the class that ``word`` was trained as, None if it was not trained."""
        for index, entry in enumerate(self.classes):
            if word in entry.aliases:
                return index
        return None

    def query_alias_of(self, word: str) -> int | None:
        """Index of the class that ``word`` stands for in queries only, None if for none."""
        for index, entry in enumerate(self.classes):
            if word in entry.query_aliases:
                return index
        return None


def load_vocabulary(folder: Path) -> Vocabulary:
    """Read ``vocabulary.json``; raises ValueError naming what is wrong."""
    path = folder / VOCABULARY_FILE
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        classes = tuple(
            ObjectClass(
                entry["name"],
                tuple(entry["aliases"]),
                tuple(entry["held_out"]),
                tuple(entry.get("also", ())),
            )
            for entry in document["classes"]
        )
        return Vocabulary(
            document["prompt"], classes, tuple(document["neutral"]), tuple(document["common"])
        )
    except OSError as problem:
        raise ValueError(f"cannot read {path}: {problem.strerror}") from problem
    except (ValueError, KeyError, TypeError) as problem:
        raise ValueError(f"{path} is not a vocabulary: {problem}") from problem


CALIBRATION_FILE = "calibration.json"


@dataclass(frozen=True, slots=True)
class Calibration:
    """Fitted on held-out apartments by ``onemap train mini``; fields as in ``calibration.json``.

    temperature: factor of the cosine in the softmax. expansion: weight of the nearest classes'
    embedding that is added to a query's own. sharpness: factor of the cosine in the softmax that
    weights those classes. synonym: cosine to the query from which a class or neutral word does
    not compete with it. floor: best score below which a query is answered "not here", measured
    by ``onemap bench queries``; 0: not measured. placed: highest cosine to any class below which
    a word counts as unlike all of them; 0.45 excludes nine in ten random strings of letters and,
    of the held-out synonyms, only "telly".
    """

    temperature: float
    expansion: float
    sharpness: float
    synonym: float
    floor: float = 0.0
    placed: float = 0.0


def load_calibration(folder: Path) -> Calibration:
    """Read ``calibration.json``; raises ValueError."""
    path = folder / CALIBRATION_FILE
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        return Calibration(**{name: float(value) for name, value in values.items()})
    except (OSError, ValueError, TypeError, AttributeError) as problem:
        raise ValueError(f"cannot read the calibration {path}: {problem}") from problem
