"""Changed shapes stand where they stood, keep their parts, and are functions of the generator."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_simulator.generation.mesh import box, cylinder, front_panel
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_tools.train.variety import shapes

GREY = Material(np.full((64, 64, 3), 128, np.uint8))
RED = Material(np.full((64, 64, 3), (200, 0, 0), np.uint8))


def cupboard(width: float = 1.0) -> Model:
    """A box on two legs, with a panel in front."""
    legs = [cylinder(0.05, 0.2, (x, 0, 0)) for x in (-0.4, 0.4)]
    body = box((width, 0.5, 1.0), (0, 0, 0.2))
    return assemble(
        "wardrobe", (GREY, [body]), (RED, [*legs, front_panel(0.3, 0.3, (0, -0.26, 0.5))])
    )


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_a_rescaled_model_keeps_its_floor_and_its_back(seed: int) -> None:
    model = shapes.rescaled(cupboard(), rng(seed), 0.2, upright=False)
    assert model.lower[2] == pytest.approx(0)
    assert model.upper[2] == pytest.approx(1.2)
    assert model.upper[1] == pytest.approx(0.25)
    taller = shapes.rescaled(cupboard(), rng(seed), 0.2, upright=True)
    assert taller.lower[2] == pytest.approx(0)


@pytest.mark.parametrize("warp", [shapes.taper, shapes.lean, shapes.twist, shapes.bow])
def test_a_warp_moves_a_model_but_not_its_floor(warp: shapes.Warp) -> None:
    before, moved = cupboard(), []
    for seed in range(6):
        model = shapes.warped(before, rng(seed), warp)
        assert model.lower[2] == pytest.approx(0, abs=1e-9)
        assert model.upper[2] == pytest.approx(before.upper[2])
        moved += [
            np.abs(new.mesh.vertices - old.mesh.vertices).max()
            for new, old in zip(model.parts, before.parts, strict=True)
        ]
    assert max(moved) > 0.02
    assert max(moved) < 0.5
    again = shapes.warped(before, rng(5), warp)
    np.testing.assert_array_equal(model.parts[0].mesh.vertices, again.parts[0].mesh.vertices)


def test_parts_of_one_material_change_together() -> None:
    before, model = cupboard(), shapes.with_part_sizes(cupboard(), rng(2), 0.2)
    legs, old = ([p.mesh for p in m.parts if p.material is RED][:2] for m in (model, before))
    apart, was = (float(pair[1].vertices[0, 0] - pair[0].vertices[0, 0]) for pair in (legs, old))
    thick, thin = (float(np.ptp(pair[0].vertices[:, 0])) for pair in (legs, old))
    assert apart / was == pytest.approx(thick / thin)
    assert apart != pytest.approx(was)
    assert model.upper[2] == before.upper[2]


def test_only_boxes_become_soft_and_keep_their_place() -> None:
    before, model = cupboard(), shapes.softened(cupboard(), rng(3))
    body, leg, panel = model.parts[0].mesh, model.parts[1].mesh, model.parts[-1].mesh
    assert len(body.vertices) > 8
    np.testing.assert_allclose(body.vertices.min(axis=0), (-0.5, -0.25, 0.2), atol=1e-9)
    np.testing.assert_allclose(body.vertices.max(axis=0), (0.5, 0.25, 1.2), atol=1e-9)
    np.testing.assert_array_equal(leg.vertices, before.parts[1].mesh.vertices)
    assert len(panel.faces) == 2


def test_a_leaning_box_is_left_alone() -> None:
    leaning = assemble("chair", (GREY, [box((1, 1, 1)).rotated("x", 20)]))
    assert len(shapes.softened(leaning, rng()).parts[0].mesh.vertices) == 8


def test_parts_of_another_fit_where_the_own_ones_were() -> None:
    own, donor = cupboard(1.0), cupboard(3.0)
    bodies = set()
    for seed in range(8):
        model = shapes.recombined(own, donor, rng(seed))
        np.testing.assert_allclose([model.lower, model.upper], [own.lower, own.upper], atol=1e-9)
        assert {id(part.material) for part in model.parts} == {id(GREY), id(RED)}
        bodies.add(model.parts[0].mesh is own.parts[0].mesh)
    assert bodies == {True, False}
    plain = assemble("wardrobe", (GREY, [box((1, 1, 1))]))
    assert shapes.recombined(own, plain, rng()) is own
