"""Groups of slots that occur in several plans, and which shapes fit where."""

from __future__ import annotations

from onemap_tools.foreign.apartment_plan import OpeningKind, Slot, free, on, wall

DOOR, PASSAGE, WINDOW = OpeningKind.DOOR, OpeningKind.PASSAGE, OpeningKind.WINDOW
HIGH_LAMPS, LOW_LAMPS = (0, 2, 4, 6), (1, 3, 5, 7)
LOW_CHESTS = (0, 3, 5)
PLACED_MIRRORS, HUNG_MIRRORS = (1, 5), (0, 2, 3, 4, 6, 7)
HUNG_BASINS, STANDING_SINKS = (3, 4), (0, 1, 2, 5, 6, 7)
HIGH_PLANTS, LOW_PLANTS = (0, 1, 2, 4), (3, 5, 6, 7)


def bed_corner(side: str, at: float, lamps: tuple[int, ...] = LOW_LAMPS) -> tuple[Slot, ...]:
    """A bed with its head to a wall, pillows on it, a night table with a lamp at each side."""
    return (
        wall("bed", side, at),
        on("pillow", "bed", -0.28, 0.62, shapes=(0, 3, 6, 5)),
        on("pillow", "bed", 0.25, 0.25, 20, shapes=(1, 2, 4, 7)),
        wall("nightstand", side, at - 1.45),
        on("lamp", "nightstand", shapes=lamps),
        wall("nightstand", side, at + 1.45),
    )


def dining(x: float, y: float, turn: float = 0.0) -> tuple[Slot, ...]:
    """A table with four chairs, one drawn back, and a vase on it."""
    chairs = (
        (x - 0.35, y - 0.68, 180),
        (x + 0.4, y - 0.85, 165),
        (x - 0.35, y + 0.68, 0),
        (x + 0.4, y + 0.7, 10),
    )
    if turn:
        chairs = (
            (x - 0.68, y - 0.35, 90),
            (x - 0.85, y + 0.4, 75),
            (x + 0.68, y - 0.35, -90),
            (x + 0.7, y + 0.4, -80),
        )
    return (
        free("table", x, y, turn),
        *(free("chair", *chair) for chair in chairs),
        on("vase", "table", 0.15, 0.05),
    )
