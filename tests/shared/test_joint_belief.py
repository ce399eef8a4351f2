"""The belief in a described thing: the kernel of relations, places, and what is not described."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from onemap_shared import messages as m
from onemap_shared.geometry import F32, F64
from onemap_shared.grid import GridSpec
from onemap_shared.joint_belief import (
    DRAW,
    FADE_M,
    REACH_M,
    UNSEEN,
    JointBelief,
    joint_belief,
    kernel,
    place_masks,
    place_weights,
    relation_belief,
)
from onemap_shared.places import NOWHERE

CELL_M = 0.1
SHAPE = (60, 50)
GRID = GridSpec(CELL_M, (0, 0), SHAPE)
KINDS = tuple(m.RelationKind)


def layer(value: float, shape: tuple[int, int] = SHAPE) -> F32:
    return np.full(shape, value, np.float32)


def believed(detail: m.Detail, **anchors: F32) -> JointBelief:
    return joint_belief(anchors, detail, places=np.ones(SHAPE), cell_size_m=CELL_M)


def related(kind: m.RelationKind) -> m.Detail:
    return m.Detail(relations=(m.Relation(kind, ("bed",)),))


@pytest.mark.parametrize("kind", KINDS)
def test_the_kernel_is_full_in_reach_half_at_the_fade_and_never_grows(kind: m.RelationKind) -> None:
    held = kernel(kind, np.linspace(0.0, 4.0, 400))
    assert (np.diff(held) <= 0).all()
    reach, half = kernel(kind, np.array([REACH_M[kind], REACH_M[kind] + FADE_M]))
    assert (reach, half) == (1.0, pytest.approx(0.5))
    assert held[-1] < 0.01


@given(
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from([m.RelationKind.NEXT_TO, m.RelationKind.ON]),
)
@settings(max_examples=25, deadline=None)
def test_it_is_the_best_anchor_in_reach(seed: int, kind: m.RelationKind) -> None:
    """As by straight distances, but for a cell and the octagon's 8 percent."""
    rng = np.random.default_rng(seed)
    anchor = np.where(rng.random(SHAPE) < 0.003, rng.random(SHAPE), 0).astype(np.float32)
    found = relation_belief(kind, anchor, CELL_M)
    least, most = np.zeros(SHAPE), np.zeros(SHAPE)
    for x, y in np.argwhere(anchor > 0):
        there = np.ones(SHAPE, bool)
        there[x, y] = False
        away_m = CELL_M * ndimage.distance_transform_edt(there)
        np.maximum(least, anchor[x, y] * kernel(kind, away_m + CELL_M), out=least)
        np.maximum(most, anchor[x, y] * kernel(kind, 0.92 * away_m - CELL_M), out=most)
    assert ((found >= least - 1e-5) | (least < 0.02)).all()  # cut off there
    assert (found <= most + 1e-5).all()


def test_a_thing_far_from_every_anchor_is_weakened_and_no_score_grows() -> None:
    anchor = layer(0.02)
    anchor[20:30, 20:30] = 0.9
    target = layer(0.8)
    found = believed(related(m.RelationKind.NEXT_TO), bed=anchor).similarity(target)
    assert (found <= target).all()
    assert found[35, 25] == pytest.approx(0.8 * 0.9)
    assert found[59, 25] < 0.05
    assert (np.diff(found[30:, 25]) <= 1e-6).all()


def test_where_nobody_looked_the_anchor_alone_draws() -> None:
    anchor = layer(0.02)
    anchor[20:30, 20:30] = 0.9
    found = believed(related(m.RelationKind.NEXT_TO), bed=anchor).similarity(
        layer(0.05), np.zeros(SHAPE, bool)
    )
    assert found[35, 25] == pytest.approx(DRAW * 0.9)
    assert found[59, 25] <= 0.05


def test_an_anchor_may_be_where_nobody_was() -> None:
    anchor = layer(0.02)
    anchor[:, 25:] = np.nan
    found = believed(related(m.RelationKind.NEXT_TO), bed=anchor).similarity(layer(0.8))
    assert found[30, 20] == pytest.approx(0.8 * UNSEEN)


def test_between_two_things_is_near_both() -> None:
    bed, sofa = layer(0.0), layer(0.0)
    bed[10, 25] = sofa[30, 25] = 1.0
    between = m.Detail(relations=(m.Relation(m.RelationKind.BETWEEN, ("bed", "sofa")),))
    found = believed(between, bed=bed, sofa=sofa).fits
    assert found[20, 25] == 1.0
    assert max(found[0, 25], found[40, 25]) < 0.01


def test_places_limit_where_it_is_and_cover_the_furniture_of_rooms() -> None:
    ids = np.full(SHAPE, m.NO_ROOM, np.int32)
    ids[5:25, 5:20] = 0
    ids[5:25, 26:45] = 1  # a wall of 0.6 m between the two, and a bed of 1 m in the first
    ids[10:20, 8:18] = m.NO_ROOM
    places = m.MapPlaces(
        1,
        1,
        (m.Place("kitchen", inside_m=(0.6, 0.6)), m.Place("hall", inside_m=(1.0, 3.0))),
        (0, 1),
        GRID,
        ids,
    )

    def weights_of(detail: m.Detail, places: m.MapPlaces = places) -> F64:
        return place_weights(detail, place_masks(detail, places, GRID), GRID)

    weights = weights_of(m.Detail(inside=("kitchen",)))
    assert weights[15, 13] == weights[6, 6] == 1.0
    assert weights[15, 40] < 0.01
    outside = weights_of(m.Detail(outside=("Kitchen",)))
    assert (outside == np.where(weights == 1.0, 0.0, 1.0)).all()
    unknown = replace(places, ids=np.full(SHAPE, m.NO_ROOM, np.int32), rooms=(m.NO_ROOM, m.NO_ROOM))
    for known in (NOWHERE, unknown):
        assert (weights_of(m.Detail(inside=("kitchen",)), known) == 1.0).all()
