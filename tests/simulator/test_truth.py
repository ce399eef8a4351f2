from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_simulator.scene import Scene
from onemap_simulator.truth import SceneTruth, distance_from_above
from tests.simulator.scenes import WALL_SIDES, SceneBuilder, box_room


def truth_of(scene: Scene) -> SceneTruth:
    return SceneTruth(scene, radius_m=0.2, height_m=1.1)


def divided_room() -> Scene:
    """6 x 4 m with a wall at x = 3 that leaves a door at y > 3; a bed in the far corner."""
    builder = SceneBuilder().add("floor", (0, 0, 0), (6, 4, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("wall", (2.9, 0, 0), (3.1, 3, 2.5)).add("bed", (5, 0.2, 0), (5.8, 1, 0.5))
    return builder.build()


def test_straight_distance_is_to_the_nearest_surface() -> None:
    found = truth_of(box_room()).distances("Sofa ", 1.5, 2.4)
    assert found.instances == 1
    assert found.straight_m == pytest.approx(1.0)


def test_inside_the_outline_the_distance_is_zero() -> None:
    assert truth_of(box_room()).distances("sofa", 2.8, 2.4).straight_m == 0.0


def test_in_the_open_the_path_is_the_straight_way_less_the_success_distance() -> None:
    builder = SceneBuilder().add("floor", (0, 0, 0), (9, 6, 2.5), sides=("z-", *WALL_SIDES))
    truth = truth_of(builder.add("ball", (7, 4, 0), (7.2, 4.2, 0.2)).build())
    for x, y in ((1.0, 1.0), (1.0, 4.1), (2.0, 5.0), (7.1, 0.6)):
        found = truth.distances("ball", x, y)
        assert found.path_m == pytest.approx(found.straight_m - 1.0, abs=0.12)


def test_the_path_goes_around_walls() -> None:
    found = truth_of(divided_room()).distances("bed", 1.0, 0.6)
    assert found.straight_m == pytest.approx(4.0)
    # Past the wall's two corners (2.9, 3) and (3.1, 3) at 0.2 m, then to 1 m from the bed.
    corner_in, corner_out = np.array([2.8, 3.2]), np.array([3.2, 3.2])
    about = (
        np.linalg.norm(corner_in - (1.0, 0.6)) + 0.4 + np.linalg.norm(corner_out - (5.0, 1.0)) - 1.0
    )
    assert found.path_m == pytest.approx(about, rel=0.06)


def test_what_is_already_near_needs_no_path() -> None:
    assert truth_of(box_room()).distances("ball", 2.0, 0.5).path_m == 0.0


def test_unknown_names_and_unreachable_things_are_infinitely_far() -> None:
    found = truth_of(box_room()).distances("elephant", 1.0, 1.0)
    assert (found.instances, found.straight_m, found.path_m) == (0, np.inf, np.inf)
    builder = SceneBuilder().add("floor", (0, 0, 0), (8, 3, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("wall", (3.9, 0, 0), (4.1, 3, 2.5)).add("bed", (6.5, 1, 0), (7.5, 2, 0.5))
    found = truth_of(builder.build()).distances("bed", 1.0, 1.0)
    assert found.straight_m == pytest.approx(5.5)
    assert found.path_m == np.inf


def test_from_within_a_wall_there_is_no_way() -> None:
    assert truth_of(divided_room()).distances("bed", 3.0, 1.0).path_m == np.inf


@settings(max_examples=50, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**16))
def test_distance_from_above_agrees_with_many_points_on_the_triangles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(-1, 1, (3, 3, 3))
    place = rng.uniform(-2, 2, 2)
    weights = rng.dirichlet((0.4, 0.4, 0.4), 20000)
    points = np.einsum("nk,tkd->tnd", weights, triangles)[..., :2]
    sampled = float(np.linalg.norm(points - place, axis=2).min())
    assert distance_from_above(triangles, place) == pytest.approx(sampled, abs=0.05)
