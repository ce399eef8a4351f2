"""Styles: named distributions of textures, colours, proportions and light."""

from __future__ import annotations

from dataclasses import dataclass

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Style:
    """The distributions that an apartment is drawn from.

    The first four fields name texture families (see ``textures``). ``size_bands`` say where in
    its nominal interval a dimension may fall: 0 is the lower end, 1 the upper, beyond is allowed.
    ``saturation`` and ``value`` bound the colours (HSV, 0 to 1), ``light`` the intensity of a
    lamp and ``ambient`` that of the ambient light, both relative to a white wall at 1.
    """

    name: str
    woods: tuple[str, ...]
    fabrics: tuple[str, ...]
    walls: tuple[str, ...]
    floors: tuple[str, ...]
    size_bands: tuple[Range, ...]
    saturation: Range
    value: Range
    light: Range
    ambient: Range


TRAINING = Style(
    name="training",
    woods=("wood", "wood", "planks", "plain"),
    fabrics=("weave", "stripes", "checks", "noise", "plain"),
    walls=("plain", "noise", "stripes", "plaster"),
    floors=("planks", "tiles", "noise", "wood", "checks"),
    size_bands=((0.0, 1.0),),
    saturation=(0.0, 0.75),
    value=(0.25, 0.98),
    light=(0.5, 1.1),
    ambient=(0.3, 0.6),
)

HELD_OUT = Style(
    name="held out",
    woods=("burl", "herringbone"),
    fabrics=("dots", "zigzag", "herringbone"),
    walls=("dots", "plaster", "zigzag"),
    floors=("herringbone", "terrazzo"),
    size_bands=((-0.2, 0.0), (1.0, 1.2)),
    saturation=(0.1, 0.9),
    value=(0.2, 1.0),
    light=(0.35, 1.3),
    ambient=(0.2, 0.7),
)

STYLES = {style.name: style for style in (TRAINING, HELD_OUT)}
