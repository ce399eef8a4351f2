"""The worlds a simulator can be told to open."""

from __future__ import annotations

from onemap_simulator.apartment import generate_apartment
from onemap_simulator.scene import Scene
from onemap_simulator.style import HELD_OUT, TRAINING

APARTMENT = "apartment"
STYLES = {style.name: style for style in (TRAINING, HELD_OUT)}


class SceneError(Exception):
    """A scene that cannot be opened; the text is one sentence that says why."""


def open_scene(name: str, *, seed: int, style: str) -> Scene:
    """The generated apartment of a seed and style."""
    if name == APARTMENT:
        return generate_apartment(seed, STYLES[style])
    raise SceneError(f"scene {name!r} is unknown: it is {APARTMENT!r}")
