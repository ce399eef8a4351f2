"""Distances, shortest paths and sight, as success is defined by them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.messages import TruthRequest
from onemap_simulator.ground_truth import SUCCESS_RADIUS_M
from onemap_simulator.ground_truth.shortest_paths import ShortestPaths
from onemap_simulator.ground_truth.truth import SceneTruth, horizontal_distances
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.scene import Scene
from tests.simulator.scenes import WALL_SIDES, SceneBuilder, box_room

Point = tuple[float, float, float]
Box = tuple[str, Point, Point]
BED: Box = ("bed", (5.0, 0.2, 0.0), (5.8, 1.0, 0.5))


def truth_of(scene: Scene) -> SceneTruth:
    return SceneTruth(scene, radius_m=0.2, height_m=1.1, eye_height_m=1.0)


def divided_room(*things: Box, wall_height_m: float = 2.5) -> Scene:
    """6 x 4 m with a wall at x = 3 that leaves a door at y > 3; a bed in the far corner."""
    builder = SceneBuilder().add("floor", (0, 0, 0), (6, 4, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("wall", (2.9, 0, 0), (3.1, 3, wall_height_m))
    for category, lower, upper in things or (BED,):
        builder.add(category, lower, upper)
    return builder.build()


def test_the_path_goes_around_walls() -> None:
    found = truth_of(divided_room()).reply(TruthRequest("Bed ", 1.0, 0.6))
    assert found.instances == 1
    assert found.distance_m == pytest.approx(4.0)
    # Past the wall's two corners (2.9, 3) and (3.1, 3) at 0.2 m, then to 1.5 m from the bed.
    corner_in, corner_out = np.array([2.8, 3.2]), np.array([3.2, 3.2])
    about = (
        np.linalg.norm(corner_in - (1.0, 0.6)) + 0.4 + np.linalg.norm(corner_out - (5.0, 1.0)) - 1.5
    )
    assert found.shortest_path_m == pytest.approx(about, rel=0.06)


def test_an_instance_behind_a_wall_is_no_success_however_near() -> None:
    truth = truth_of(divided_room(("bed", (3.3, 0.2, 0), (4.1, 1.0, 0.5))))
    before_the_wall = truth.reply(TruthRequest("bed", 2.6, 0.6))
    assert before_the_wall.distance_m < SUCCESS_RADIUS_M
    assert before_the_wall.shortest_path_m > 3.0


def test_the_instance_within_the_radius_must_be_the_one_in_sight() -> None:
    """One bed is near and hidden, another is in sight and far: neither makes a success."""
    scene = divided_room(("bed", (3.3, 0.2, 0), (4.1, 1.0, 0.5)), ("bed", (0, 3.5, 0), (1, 4, 0.5)))
    assert truth_of(scene).path_m("bed", 2.6, 0.6) > 1.0


def test_a_success_place_is_at_distance_zero_and_no_other_free_place_is() -> None:
    scene = divided_room()
    truth = truth_of(scene)
    grid, places = truth.success_cells("bed")
    free = CollisionMap.of(scene, 1.1, grid.cell_size_m).clearance >= 0.2
    for cell in np.argwhere(free)[::9]:
        distance = truth.path_m("bed", *grid.centres(cell))
        assert (distance == 0.0) == places[tuple(cell)]


def test_unknown_names_and_unreachable_objects_are_infinitely_far() -> None:
    found = truth_of(box_room()).reply(TruthRequest("elephant", 1.0, 1.0))
    assert (found.instances, found.distance_m, found.shortest_path_m) == (0, np.inf, np.inf)
    builder = SceneBuilder().add("floor", (0, 0, 0), (8, 3, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("wall", (3.9, 0, 0), (4.1, 3, 2.5)).add("bed", (6.5, 1, 0), (7.5, 2, 0.5))
    found = truth_of(builder.build()).reply(TruthRequest("bed", 1.0, 1.0))
    assert found.distance_m == pytest.approx(5.5)
    assert found.shortest_path_m == np.inf


def test_without_a_name_only_what_the_scene_has_is_told() -> None:
    told = truth_of(divided_room()).reply(TruthRequest("", 1.0, 0.6))
    assert "bed" in told.categories
    assert (told.instances, told.shortest_path_m) == (0, np.inf)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**16))
def test_horizontal_distance_agrees_with_many_points_on_the_triangles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(-1, 1, (3, 3, 3))
    place = rng.uniform(-2, 2, 2)
    weights = rng.dirichlet((0.4, 0.4, 0.4), 20000)
    points = np.einsum("nk,tkd->tnd", weights, triangles)[..., :2]
    sampled = float(np.linalg.norm(points - place, axis=2).min())
    assert horizontal_distances(triangles, place).min() == pytest.approx(sampled, abs=0.05)


def test_the_least_way_between_two_categories() -> None:
    sofa: Box = ("sofa", (0.2, 0.2, 0.0), (1.0, 1.0, 0.5))
    chair: Box = ("chair", (4.6, 0.4, 0.0), (4.9, 0.8, 0.9))
    truth = truth_of(divided_room(BED, sofa, chair))
    assert truth.least_way_m("bed", "chair") == 0.0
    assert 3.0 < truth.least_way_m("sofa", "bed") < 8.0
    assert truth.least_way_m("sofa", "toilet") == np.inf


cells = st.tuples(st.integers(0, 39), st.integers(0, 29))


def goals_at(*places: tuple[int, int]) -> np.ndarray:
    goals = np.zeros((40, 30), bool)
    for place in places:
        goals[place] = True
    return goals


@settings(max_examples=40, deadline=None, derandomize=True)
@given(start=cells, first=cells, second=cells)
def test_in_the_open_it_is_the_straight_line_to_the_nearest_goal(
    start: tuple[int, int], first: tuple[int, int], second: tuple[int, int]
) -> None:
    paths = ShortestPaths.to(goals_at(first, second), np.ones((40, 30), bool))
    straight = min(np.hypot(*np.subtract(start, end)) for end in (first, second))
    length = paths.length(np.array(start))
    assert straight - 1e-9 <= length <= 1.014 * straight + 1e-9
