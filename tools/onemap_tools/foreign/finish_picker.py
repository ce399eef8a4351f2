"""Draws finishes for the parts of one piece, within the palette of its apartment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import U8
from onemap_tools.foreign import textures
from onemap_tools.foreign.finish import Finish
from onemap_tools.foreign.textures import Colour, mix, shade


@dataclass(frozen=True, slots=True)
class ApartmentPalette:
    """Colours, 0 to 1, that the things of an apartment are chosen from."""

    woods: tuple[Colour, ...]
    textiles: tuple[Colour, ...]
    lacquers: tuple[Colour, ...]
    walls: tuple[Colour, ...]


NORTHERN = ApartmentPalette(
    woods=((0.80, 0.64, 0.44), (0.90, 0.80, 0.62), (0.62, 0.46, 0.30)),
    textiles=((0.55, 0.58, 0.60), (0.22, 0.33, 0.42), (0.82, 0.78, 0.70), (0.68, 0.52, 0.22)),
    lacquers=((0.93, 0.93, 0.91), (0.30, 0.36, 0.38), (0.62, 0.70, 0.66)),
    walls=((0.93, 0.92, 0.89), (0.80, 0.85, 0.86), (0.90, 0.86, 0.80)),
)
OLD_TOWN = ApartmentPalette(
    woods=((0.42, 0.23, 0.13), (0.33, 0.19, 0.12), (0.56, 0.36, 0.20)),
    textiles=((0.48, 0.12, 0.14), (0.18, 0.30, 0.20), (0.76, 0.64, 0.44), (0.28, 0.20, 0.34)),
    lacquers=((0.88, 0.84, 0.74), (0.16, 0.28, 0.24), (0.50, 0.14, 0.12)),
    walls=((0.88, 0.82, 0.66), (0.70, 0.78, 0.66), (0.84, 0.72, 0.64)),
)
LOFT = ApartmentPalette(
    woods=((0.50, 0.38, 0.27), (0.24, 0.20, 0.18), (0.72, 0.58, 0.40)),
    textiles=((0.20, 0.21, 0.23), (0.76, 0.34, 0.16), (0.14, 0.40, 0.42), (0.70, 0.70, 0.68)),
    lacquers=((0.12, 0.12, 0.13), (0.86, 0.86, 0.88), (0.90, 0.66, 0.12)),
    walls=((0.76, 0.75, 0.73), (0.92, 0.92, 0.93), (0.44, 0.50, 0.56)),
)


@dataclass(frozen=True, slots=True)
class FinishPicker:
    """Makes finishes from a palette with a generator of its own."""

    rng: np.random.Generator
    palette: ApartmentPalette

    def between(self, low: float, high: float) -> float:
        """A random number."""
        return float(self.rng.uniform(low, high))

    def one_of(self, colours: tuple[Colour, ...]) -> Colour:
        """One colour, lighter or darker by up to a tenth."""
        return shade(colours[int(self.rng.integers(len(colours)))], self.between(0.9, 1.1))

    def wood(self, colour: Colour | None = None, gloss: float = 0.12) -> Finish:
        """Oiled or varnished wood."""
        tone = colour or self.one_of(self.palette.woods)
        return Finish(textures.wood(self.rng, tone), 0.5, gloss, 30.0)

    def cloth(self, colour: Colour | None = None) -> Finish:
        """Upholstery: plain, striped, checked or printed."""
        tone = colour or self.one_of(self.palette.textiles)
        other = self.one_of(self.palette.textiles)
        kind = int(self.rng.integers(8)) if colour is None else 0
        makers: dict[int, Callable[[], U8]] = {
            5: lambda: textures.stripes(self.rng, tone, other),
            6: lambda: textures.plaid(self.rng, tone, other),
            7: lambda: textures.blossoms(self.rng, mix(tone, (1, 1, 1), 0.5), other),
        }
        coarse = int(self.rng.choice([32, 64, 128]))
        woven = makers[kind]() if kind in makers else textures.weave(self.rng, tone, coarse)
        return Finish(woven, self.between(0.25, 0.6), 0.02, 6.0)

    def leather(self, colour: Colour | None = None) -> Finish:
        """Leather with highlights."""
        hides = ((0.36, 0.20, 0.12), (0.10, 0.09, 0.09), (0.62, 0.40, 0.22), (0.78, 0.74, 0.68))
        return Finish(textures.leather(self.rng, colour or self.one_of(hides)), 0.35, 0.22, 24.0)

    def lacquer(self, colour: Colour | None = None) -> Finish:
        """Painted furniture: smooth, with a soft reflection."""
        tone = colour or self.one_of(self.palette.lacquers)
        return Finish(textures.plain(self.rng, tone), 1.0, 0.25, 60.0, 0.04)

    def ceramic(self, colour: Colour = (0.93, 0.93, 0.92)) -> Finish:
        """Glazed white."""
        return Finish(textures.plain(self.rng, colour, 0.006), 1.0, 0.45, 120.0, 0.06)

    def plastic(self, colour: Colour) -> Finish:
        """Dull plastic."""
        return Finish(textures.plain(self.rng, colour), 0.5, 0.1, 16.0)

    def steel(self, colour: Colour = (0.66, 0.67, 0.68)) -> Finish:
        """Brushed steel."""
        return Finish(textures.brushed(self.rng, colour), 0.8, 0.5, 24.0, 0.14, metal=True)

    def chrome(self) -> Finish:
        """Polished metal."""
        return Finish(
            textures.plain(self.rng, (0.72, 0.73, 0.75)), 0.5, 0.8, 90.0, 0.45, metal=True
        )

    def iron(self) -> Finish:
        """Black powder-coated metal."""
        return Finish(textures.plain(self.rng, (0.07, 0.07, 0.075)), 0.5, 0.18, 18.0)

    def brass(self) -> Finish:
        """Polished brass."""
        return Finish(
            textures.brushed(self.rng, (0.74, 0.56, 0.26)), 0.4, 0.6, 40.0, 0.2, metal=True
        )

    def dark_glass(self) -> Finish:
        """The door of an oven, the top of a hob."""
        return Finish(textures.plain(self.rng, (0.05, 0.05, 0.055)), 1.0, 0.6, 160.0, 0.22)

    def silver(self) -> Finish:
        """The glass of a mirror."""
        return Finish(textures.plain(self.rng, (0.78, 0.82, 0.82), 0.0), 1.0, 0.5, 400.0, 0.9)

    def wicker(self) -> Finish:
        """Plaited cane."""
        tone = self.one_of(((0.72, 0.54, 0.32), (0.46, 0.30, 0.17), (0.84, 0.74, 0.56)))
        return Finish(textures.wicker(self.rng, tone), 0.14, 0.05, 12.0)

    def marble(self) -> Finish:
        """Polished stone."""
        pale = bool(self.rng.integers(2))
        ground, vein = (
            ((0.92, 0.91, 0.9), (0.45, 0.46, 0.5))
            if pale
            else ((0.1, 0.12, 0.11), (0.75, 0.74, 0.7))
        )
        return Finish(textures.marble(self.rng, ground, vein), 0.9, 0.4, 120.0, 0.08)

    def shown(self, image: U8, glow: float = 0.0, gloss: float = 0.1) -> Finish:
        """An image on a panel; a screen glows."""
        return Finish(image, 1.0, gloss, 80.0, 0.03 if glow else 0.0, glow)

    def light(self, colour: Colour = (1.0, 0.9, 0.72), strength: float = 1.0) -> Finish:
        """A shade lit from within."""
        return Finish(textures.plain(self.rng, colour, 0.02), 0.4, 0.0, 1.0, 0.0, strength)
