"""Another design in the place of a thing: it fits, and what stood on it still stands."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_simulator.generation.mesh import box
from onemap_simulator.generation.model import Material, Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.catalogue import TRAINING
from onemap_tools.train.variety.kinds import VARIED
from onemap_tools.train.variety.redesign import SQUEEZED, WIDER, redesigned

PAINT = Material(np.full((8, 8, 3), 200, np.uint8))
sides_m = st.floats(0.2, 2.0)


def block(width: float, depth: float, height: float, *, y: float = 0.0) -> Model:
    """A box with a support surface on top."""
    surfaces = (support_surface(width, depth, height),)
    mesh = box((width, depth, height), (0.0, y, 0.0))
    return assemble("table", (PAINT, [mesh]), support_surfaces=surfaces)


def sampler(seed: int = 0) -> Sampler:
    return Sampler(np.random.default_rng(seed), VARIED.style)


def always(model: Model) -> list[ModelFactory]:
    return [lambda _: model]


@given(old=st.tuples(sides_m, sides_m, sides_m), new=st.tuples(sides_m, sides_m, sides_m))
def test_it_stays_in_the_room_with_its_back_at_the_same_place(
    old: tuple[float, float, float], new: tuple[float, float, float]
) -> None:
    before = block(*old, y=0.3)
    after = redesigned(before, always(block(*new)), sampler())
    assert after.upper[1] == pytest.approx(before.upper[1])
    assert (after.lower[0] + after.upper[0]) / 2 == pytest.approx(0, abs=1e-9)
    assert after.lower[2] == pytest.approx(0, abs=1e-9)
    assert ((after.upper - after.lower)[:2] <= np.array(old[:2]) * WIDER + 1e-9).all()
    if after is not before:
        assert ((after.upper - after.lower) >= np.array(new) * SQUEEZED - 1e-9).all()


@given(old=st.tuples(sides_m, sides_m, sides_m), new=st.tuples(sides_m, sides_m, sides_m))
def test_what_stands_on_it_still_does(
    old: tuple[float, float, float], new: tuple[float, float, float]
) -> None:
    before = block(*old)
    after = redesigned(before, always(block(*new)), sampler(), carried_z=(old[2], old[2]))
    np.testing.assert_allclose(after.upper, before.upper)
    np.testing.assert_allclose(after.lower, before.lower, atol=1e-9)
    assert after.support_surfaces[0].z == pytest.approx(old[2])


def test_nothing_changes_where_no_design_fits() -> None:
    thing = block(0.5, 0.5, 0.5)
    assert redesigned(thing, always(block(5.0, 0.5, 0.5)), sampler()) is thing
    bare = assemble("table", (PAINT, [box((0.5, 0.5, 0.5))]))
    assert redesigned(thing, always(bare), sampler(), carried_z=(0.5,)) is thing
    # Things on two levels, as in a bookcase: one top cannot carry both.
    assert redesigned(thing, always(block(0.5, 0.5, 0.5)), sampler(), carried_z=(0.2, 0.5)) is thing


def test_on_a_wall_it_grows_no_higher_than_what_hung_there() -> None:
    picture = block(0.6, 0.05, 0.4)
    tall = always(block(0.6, 0.05, 0.5))
    hung = redesigned(picture, tall, sampler(), on_floor=False)
    assert hung.upper[2] <= 0.4 * 1.1 + 1e-9
    assert redesigned(picture, tall, sampler()).upper[2] >= 0.5


def test_real_designs_take_the_place_of_a_sofa() -> None:
    room = assemble("sofa", (PAINT, [box((2.2, 0.9, 0.85))]))
    shapes = [redesigned(room, TRAINING["sofa"], sampler(seed)) for seed in range(12)]
    changed = [model for model in shapes if model is not room]
    assert len(changed) >= 10
    assert len({round(float(np.prod(model.upper - model.lower)), 6) for model in changed}) >= 10
