"""The descriptions of fields, read from the "Attributes" section of docstrings."""

from __future__ import annotations

import dataclasses
import inspect
import re
from dataclasses import dataclass

HEADING = "Attributes:"
ENTRY = re.compile(r"    (\w+): (.*)")
SHAPE = re.compile(r"(\([^)]*\)) (.*)")


@dataclass(frozen=True, slots=True)
class DocstringParts:
    """A docstring in two parts: its text, and what it says of each field, in one line each."""

    text: str
    fields: dict[str, str]


def parse(docstring: str) -> DocstringParts:
    """Split a docstring at "Attributes:"; lines that are indented further continue an entry."""
    text, _, section = inspect.cleandoc(docstring).partition(HEADING)
    fields: dict[str, str] = {}
    name = ""
    for line in section.splitlines():
        entry = ENTRY.fullmatch(line)
        if entry:
            name = entry[1]
            fields[name] = entry[2]
        elif line.strip() and name:
            fields[name] += " " + line.strip()
    return DocstringParts(text.strip(), fields)


def field_notes(cls: type, common: dict[str, str]) -> dict[str, str]:
    """What each field of a dataclass means: its own docstring first, then ``common``.

    Raises ValueError if a field is described nowhere, or if there is no such field.
    """
    own = parse(cls.__doc__ or "").fields
    names = [field.name for field in dataclasses.fields(cls)]
    missing = [name for name in names if name not in own and name not in common]
    if missing or not own.keys() <= set(names):
        wrong = ", ".join(missing or sorted(own.keys() - set(names)))
        raise ValueError(
            f"{cls.__name__}: 'Attributes:' of its docstring and its fields differ in {wrong}"
        )
    return {name: own.get(name, common.get(name, "")) for name in names}


def split_shape(note: str) -> tuple[str, str]:
    """The shape at the beginning of an array's description, and the rest of it."""
    match = SHAPE.fullmatch(note)
    if match is None:
        raise ValueError(f"the description of an array begins with its shape, not with {note!r}")
    return match[1], match[2]
