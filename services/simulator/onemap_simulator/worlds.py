"""The worlds a simulator can be told to open."""

from __future__ import annotations

from pathlib import Path

from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import HELD_OUT, TRAINING
from onemap_simulator.scene.loading import SUFFIXES, check_file, load_scene
from onemap_simulator.scene.scene import Scene

APARTMENT = "apartment"
STYLES = {style.name: style for style in (TRAINING, HELD_OUT)}


def open_scene(name: str, *, seed: int, style: str) -> Scene:
    """The generated apartment of a seed and style, or the scene in a file.

    Raises ValueError with one sentence for a scene that cannot be opened.
    """
    check_scene(name)
    if name == APARTMENT:
        return generate_apartment(seed, STYLES[style])
    return load_scene(Path(name))


def check_scene(name: str) -> None:
    """Raise ValueError with one sentence if there is no such scene; opens none."""
    if name == APARTMENT:
        return
    if not Path(name).suffix:
        raise ValueError(
            f"scene {name!r} is unknown: write {APARTMENT!r} or the path of a file "
            f"({', '.join(SUFFIXES)})"
        )
    check_file(Path(name))
