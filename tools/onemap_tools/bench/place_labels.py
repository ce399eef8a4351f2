"""Labelled places: what stands where, from a YAML file or from a scene with named objects."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from onemap_simulator.scene.scene import STRUCTURE, UNNAMED, Scene

KEYS = ("name", "x", "y", "radius_m")
MAX_M = 100_000  # of a coordinate or a radius: what is larger is not in metres
MARGIN_M = 0.3  # around an object of a scene: an answer's centre may lie on its edge


@dataclass(frozen=True, slots=True)
class PlaceLabel:
    """Something called ``name`` stands within ``radius_m`` of (x, y), metres in the map frame."""

    name: str
    x: float
    y: float
    radius_m: float


def read_labels(path: Path) -> tuple[PlaceLabel, ...]:
    """The labels of a YAML file: a list, maybe empty, of entries with KEYS.

    ValueError names the wrong entry.
    """
    try:
        entries = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise ValueError(f"cannot read {path}: {problem.strerror or problem}") from problem
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        raise ValueError(f"{path} is not valid YAML: {' '.join(str(problem).split())}") from problem
    if not isinstance(entries, list):
        raise ValueError(
            f"{path} must be a list of places, each with {', '.join(KEYS)}, or [] for none"
        )
    return tuple(
        _label(entry, f"{path}, entry {number}") for number, entry in enumerate(entries, 1)
    )


def _label(entry: Any, where: str) -> PlaceLabel:
    if not isinstance(entry, dict):
        raise ValueError(f"{where} is {entry!r}; it must have {', '.join(KEYS)}")
    if missing := [key for key in KEYS if key not in entry]:
        raise ValueError(f"{where} lacks {', '.join(missing)}")
    if unknown := sorted(str(key) for key in entry if key not in KEYS):
        raise ValueError(f"{where} has the unknown key {unknown[0]!r}; known are {', '.join(KEYS)}")
    name = entry["name"]
    if not isinstance(name, str) or not name.strip():
        raise ValueError(f"{where}: name is {name!r}; it must be a word")
    for key in KEYS[1:]:
        value = entry[key]
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not (number and abs(value) <= MAX_M):
            raise ValueError(
                f"{where}: {key} is {value!r}; it must be a number of metres up to {MAX_M}"
            )
    if entry["radius_m"] <= 0:
        raise ValueError(f"{where}: radius_m is {entry['radius_m']}; it must be positive")
    return PlaceLabel(name.strip(), *(float(entry[key]) for key in KEYS[1:]))


def labels_of_scene(scene: Scene) -> tuple[PlaceLabel, ...]:
    """A label for each object with a name that is no part of the building.

    Around the middle of the rectangle that the object covers seen from above, MARGIN_M wider
    than the circle around it.
    """
    labels = []
    for index, thing in enumerate(scene.objects):
        faces = scene.faces[scene.face_object == index]
        if thing.category in STRUCTURE | {UNNAMED} or not len(faces):
            continue
        corners = scene.vertices[faces].reshape(-1, 3)[:, :2].astype(np.float64)
        lower, upper = corners.min(axis=0), corners.max(axis=0)
        x, y = (lower + upper) / 2
        radius_m = float(np.linalg.norm(upper - lower)) / 2 + MARGIN_M
        labels.append(PlaceLabel(thing.category, float(x), float(y), radius_m))
    return tuple(labels)
