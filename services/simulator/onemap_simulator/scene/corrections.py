"""Corrections of a scene file: the YAML beside it, with categories, start, up axis and floor."""
# Touches files: the YAML beside a scene.

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml


@dataclass(frozen=True, slots=True)
class Corrections:
    """Contents of ``<stem>.yaml``: node to category, start (x, y, yaw in the map), up axis.

    ``floor_m``: the floor's height along the up axis of the file.
    """

    categories: dict[str, str] = field(default_factory=dict)
    start: tuple[float, float, float] | None = None
    up: str | None = None
    floor_m: float | None = None


def read_corrections(path: Path) -> Corrections:
    """Read the YAML beside a scene; a missing file is empty. ValueError names the wrong key."""
    if not path.is_file():
        return Corrections()
    try:
        raw = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not valid YAML: {' '.join(str(error).split())}") from error
    if not isinstance(raw, dict):
        raise ValueError(f"{path} must hold keys and values, not a {type(raw).__name__}")
    unknown = set(raw) - {"categories", "start", "up", "floor"}
    if unknown:
        raise ValueError(
            f"{path}: unknown key {min(map(str, unknown))!r}; known are categories, start, up, "
            "floor"
        )
    categories, start, up = raw.get("categories") or {}, raw.get("start"), raw.get("up")
    if not isinstance(categories, dict) or not all(
        isinstance(node, str) and isinstance(name, str) for node, name in categories.items()
    ):
        raise ValueError(f"{path}: categories must map node names to category names")
    if up not in (None, "y", "z"):
        raise ValueError(f"{path}: up is {up!r}; it must be y or z")
    floor = raw.get("floor")
    if floor is not None and not _is_number(floor):
        raise ValueError(f"{path}: floor is {floor!r}; it must be a height in metres")
    return Corrections(dict(categories), _start_of(path, start), up, floor)


def _start_of(path: Path, value: Any) -> tuple[float, float, float] | None:
    if value is None:
        return None
    numbers = isinstance(value, list) and all(_is_number(v) for v in value)
    if not numbers or len(value) != 3:
        raise ValueError(f"{path}: start is {value!r}; it must be three numbers [x, y, yaw]")
    return (float(value[0]), float(value[1]), float(value[2]))


def _is_number(value: Any) -> bool:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return number and bool(np.isfinite(value))
