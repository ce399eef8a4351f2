"""Styles: distributions of textures, colours, proportions and light; and draws from them."""

from __future__ import annotations

import colorsys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from onemap_simulator.generation.mesh import Material, Model
from onemap_simulator.generation.textures import texture

T = TypeVar("T")
Rgb = tuple[float, float, float]

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


@dataclass(frozen=True, slots=True)
class Sampler:
    """Draws from ``rng`` what ``style`` allows. The draws, in their order, define an apartment."""

    rng: np.random.Generator
    style: Style

    def size(self, low: float, high: float) -> float:
        """A dimension whose nominal interval is low to high, in one of the style's size bands."""
        band = self.style.size_bands[int(self.rng.integers(len(self.style.size_bands)))]
        return float(low + (high - low) * self.rng.uniform(*band))

    def sizes(self, *intervals: Range) -> list[float]:
        """One dimension for each nominal interval."""
        return [self.size(*interval) for interval in intervals]

    def uniform(self, low: float, high: float) -> float:
        """A uniform number between the limits, independent of the style."""
        return float(self.rng.uniform(low, high))

    def integer(self, low: int, high: int) -> int:
        """An integer from low to high, both included."""
        return int(self.rng.integers(low, high + 1))

    def chance(self, probability: float) -> bool:
        """True with this probability."""
        return bool(self.rng.random() < probability)

    def choice(self, choices: Sequence[T]) -> T:
        """One of the choices, with equal probability."""
        return choices[int(self.rng.integers(len(choices)))]

    def colour(self) -> Rgb:
        """Any colour of the style."""
        hue, saturation, value = (
            self.rng.random(),
            self.rng.uniform(*self.style.saturation),
            self.rng.uniform(*self.style.value),
        )
        return colorsys.hsv_to_rgb(hue, saturation, value)

    def grey(self, low: float, high: float, tint: float = 0.06) -> Rgb:
        """A nearly neutral colour of brightness low to high."""
        value = self.rng.uniform(low, high)
        return colorsys.hsv_to_rgb(self.rng.random(), self.rng.uniform(0, tint), value)

    def material(
        self, family: str, tile_m: float, first: Rgb, second: Rgb | None = None
    ) -> Material:
        """A material of the texture family; the second colour defaults to a shade of the first."""
        if second is None:
            shade = self.rng.uniform(0.55, 0.85)
            second = (first[0] * shade, first[1] * shade, first[2] * shade)
        return Material(texture(family, self.rng, (first, second)), tile_m)

    def wood(self) -> Material:
        """Wood, natural in half of the cases, otherwise stained or painted."""
        family = self.choice(self.style.woods)
        if self.chance(0.5):
            hue, saturation = self.uniform(0.05, 0.11), self.uniform(0.25, 0.65)
            colour = colorsys.hsv_to_rgb(hue, saturation, self.uniform(0.3, 0.85))
        else:
            colour = self.colour()
        return self.material(family, self.uniform(0.5, 1.0), colour)

    def fabric(self) -> Material:
        """Cloth, patterned or plain, two colours of which one may be a shade of the other."""
        family = self.choice(self.style.fabrics)
        other = self.colour() if self.chance(0.4) else None
        return self.material(family, self.uniform(0.25, 0.6), self.colour(), other)

    def upholstery(self) -> Material:
        """Cloth or leather."""
        if self.chance(0.3):
            return self.material("leather", 0.3, self.colour())
        return self.fabric()

    def metal(self) -> Material:
        """Brushed metal: steel, black or brass."""
        colour = self.choice([self.grey(0.55, 0.85), self.grey(0.08, 0.25), (0.75, 0.6, 0.3)])
        return self.material("brushed", 0.4, colour)

    def plastic(self) -> Material:
        """A plain, even colour."""
        return self.material("plain", 0.5, self.colour())

    def ceramic(self) -> Material:
        """Glazed ceramic: white, tinted or marbled."""
        family = "plain" if self.chance(0.8) else "marble"
        colour = self.grey(0.8, 0.98) if self.chance(0.65) else self.colour()
        return self.material(family, 0.6, colour)

    def enamel(self) -> Material:
        """The casing of an appliance: white, steel, black or a colour."""
        kind = self.integer(0, 3)
        if kind == 0:
            return self.material("plain", 0.5, self.grey(0.8, 0.97))
        if kind == 1:
            return self.material("brushed", 0.5, self.grey(0.5, 0.75))
        return self.material("plain", 0.5, self.grey(0.1, 0.25) if kind == 2 else self.colour())

    def dark(self) -> Material:
        """Nearly black: screens, hobs, tyres."""
        return self.material("plain", 0.5, self.grey(0.03, 0.14))

    def pale(self) -> Material:
        """Nearly white: lamp shades, linen, paper."""
        return self.material("plain", 0.5, self.grey(0.82, 1.0, tint=0.12))

    def foliage(self) -> Material:
        """Foliage: green with some yellow, blue or dryness."""
        hue, value = self.uniform(0.2, 0.42), self.uniform(0.25, 0.7)
        return self.material(
            "noise", 0.15, colorsys.hsv_to_rgb(hue, self.uniform(0.35, 0.85), value)
        )


ModelFactory = Callable[[Sampler], Model]
