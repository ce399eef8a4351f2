"""The classes that ``mini`` was trained on, and the words it is evaluated with."""
# Touches files: vocabulary.

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
