"""Which cells of the map a place covers."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.geometry import F64
from onemap_shared.grid import GridSpec
from onemap_shared.messages import NO_ROOM, MapPlaces, Place, PlaceKind
from onemap_shared.places import Zones, place_mask, polygon_mask

GRID = GridSpec(0.1, (-20, -10), (60, 50))


def places(*known: Place) -> MapPlaces:
    ids = np.full(GRID.shape, NO_ROOM, np.int32)
    return MapPlaces(1, 1, known, (NO_ROOM,) * len(known), GRID, ids)


def polygon(seed: int) -> tuple[F64, Place]:
    rng = np.random.default_rng(seed)
    corners = rng.uniform((-3.0, -2.0), (5.0, 5.0), (int(rng.integers(3, 8)), 2))
    return corners, Place("p", PlaceKind.KEEP_OUT, corners_m=tuple(map(tuple, corners.tolist())))


@pytest.mark.parametrize("seed", range(10))
def test_a_zone_covers_every_cell_that_holds_a_part_of_it(seed: int) -> None:
    corners, place = polygon(seed)
    mask, rng = Zones(places(place)).mask(GRID), np.random.default_rng(seed)
    edge = rng.integers(0, len(corners), 2000)
    along = rng.uniform(0, 1, (2000, 1))
    points = corners[edge] + along * (np.roll(corners, -1, axis=0)[edge] - corners[edge])
    cells = GRID.cells(points)
    cells = cells[GRID.contains(cells)]
    assert mask[tuple(cells.T)].all()
    inside = polygon_mask(corners, GRID)
    assert not (inside & ~mask).any()
    assert (place_mask(places(place), "P", GRID) == inside).all()


def test_a_zone_thinner_than_a_cell_is_closed() -> None:
    tape = Place("tape", PlaceKind.KEEP_OUT, corners_m=((0, 0), (0.02, 0), (0.02, 2), (0, 2)))
    assert Zones(places(tape)).mask(GRID)[:, 10:30].any(axis=0).all()


def test_places_to_stay_out_of_count_as_zones_and_others_do_not() -> None:
    rug = Place("rug", corners_m=((0, 0), (1, 0), (1, 1)))
    assert not Zones(places(rug)).mask(GRID).any()
    assert Zones(places(rug), ("Rug",)).mask(GRID).any()
    unknown = Zones(places(rug), ("attic",))
    assert not unknown.mask(GRID).any()
    assert unknown.problem() == "there is no place 'attic' any more"
