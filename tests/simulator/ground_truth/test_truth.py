from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.ground_truth import SUCCESS_RADIUS_M
from onemap_simulator.ground_truth.truth import SceneTruth, horizontal_distances
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.scene import Scene
from tests.reference.success import literal_success
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


def clearance_in_divided_room(place: np.ndarray) -> float:
    """Distance in metres to the room's sides, the wall within it and the bed, by arithmetic."""
    boxes = [(np.array([2.9, 0]), np.array([3.1, 3])), (np.array([5, 0.2]), np.array([5.8, 1]))]
    to_boxes = [
        np.linalg.norm(np.maximum(np.maximum(low - place, place - high), 0)) for low, high in boxes
    ]
    return float(min(*place, *((6, 4) - place), *to_boxes))


def test_straight_distance_is_to_the_nearest_surface() -> None:
    found = truth_of(box_room()).distances("Sofa ", 1.5, 2.4)
    assert found.instances == 1
    assert found.straight_line_m == pytest.approx(1.0)


def test_inside_the_outline_the_distance_is_zero() -> None:
    assert truth_of(box_room()).distances("sofa", 2.8, 2.4).straight_line_m == 0.0


def test_in_the_open_the_path_is_the_straight_line_less_the_success_radius() -> None:
    builder = SceneBuilder().add("floor", (0, 0, 0), (9, 6, 2.5), sides=("z-", *WALL_SIDES))
    truth = truth_of(builder.add("ball", (7, 4, 0), (7.2, 4.2, 0.2)).build())
    for x, y in ((1.0, 1.0), (1.0, 4.1), (2.0, 5.0), (7.1, 0.6)):
        found = truth.distances("ball", x, y)
        assert found.path_m == pytest.approx(found.straight_line_m - SUCCESS_RADIUS_M, abs=0.12)


def test_the_path_goes_around_walls() -> None:
    found = truth_of(divided_room()).distances("bed", 1.0, 0.6)
    assert found.straight_line_m == pytest.approx(4.0)
    # Past the wall's two corners (2.9, 3) and (3.1, 3) at 0.2 m, then to 1.5 m from the bed.
    corner_in, corner_out = np.array([2.8, 3.2]), np.array([3.2, 3.2])
    about = (
        np.linalg.norm(corner_in - (1.0, 0.6)) + 0.4 + np.linalg.norm(corner_out - (5.0, 1.0)) - 1.5
    )
    assert found.path_m == pytest.approx(about, rel=0.06)


def test_an_instance_behind_a_wall_is_no_success_however_near() -> None:
    truth = truth_of(divided_room(("bed", (3.3, 0.2, 0), (4.1, 1.0, 0.5))))
    before_the_wall = truth.distances("bed", 2.6, 0.6)
    assert before_the_wall.straight_line_m < SUCCESS_RADIUS_M
    assert before_the_wall.path_m > 3.0


def test_the_instance_within_the_radius_must_be_the_one_in_sight() -> None:
    """One bed is near and hidden, another is in sight and far: neither makes a success."""
    scene = divided_room(("bed", (3.3, 0.2, 0), (4.1, 1.0, 0.5)), ("bed", (0, 3.5, 0), (1, 4, 0.5)))
    assert truth_of(scene).distances("bed", 2.6, 0.6).path_m > 1.0


def test_what_is_seen_over_a_low_obstacle_is_in_sight() -> None:
    low = divided_room(("bed", (3.3, 0.2, 0), (4.1, 1.0, 0.5)), wall_height_m=0.6)
    assert truth_of(low).distances("bed", 2.6, 0.6).path_m == 0.0


@pytest.mark.parametrize("scene", [box_room(), divided_room()], ids=["room", "divided"])
def test_success_places_agree_with_their_definition_taken_literally(scene: Scene) -> None:
    for category in {"sofa", "ball", "bed"} & set(scene.categories):
        grid, places = truth_of(scene).success_cells(category)
        assert places.any()
        cells = np.argwhere(np.ones_like(places))[::7]
        literal = literal_success(scene, category, grid.centres(cells))
        assert (literal != places[tuple(cells.T)]).mean() < 0.03  # where the robot just fits


def test_a_success_place_is_at_distance_zero_and_no_other_free_place_is() -> None:
    scene = divided_room()
    truth = truth_of(scene)
    grid, places = truth.success_cells("bed")
    free = CollisionMap.of(scene, 1.1, grid.cell_size_m).clearance >= 0.2
    for cell in np.argwhere(free)[::9]:
        distance = truth.distances("bed", *grid.centres(cell)).path_m
        assert (distance == 0.0) == places[tuple(cell)]


TRUTH = truth_of(divided_room())
inside = st.tuples(st.floats(0.25, 5.75), st.floats(0.25, 3.75))


@settings(max_examples=150, deadline=None, derandomize=True)
@given(place=inside, step=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)))
def test_the_path_never_grows_by_more_than_the_step(
    place: tuple[float, float], step: tuple[float, float]
) -> None:
    x, y = place[0] + step[0], place[1] + step[1]
    between = np.linspace(place, (x, y), 20)
    assume(all(clearance_in_divided_room(p) > 0.3 for p in between))
    before = TRUTH.distances("bed", *place).path_m
    after = TRUTH.distances("bed", x, y).path_m
    # Either place stands for its cell's centre, and paths are within 1.4 % of the shortest.
    assert after <= before + np.hypot(*step) + 2 * 0.05 / np.sqrt(2) + 0.014 * before


def test_the_nearest_object_is_named_and_walls_are_not() -> None:
    truth = truth_of(box_room())
    assert truth.nearest(1.0, 1.0) == "ball"
    assert truth.nearest(2.0, 2.5) == "sofa"
    assert truth.nearest(0.0, 3.0) == "sofa"


def test_of_objects_above_one_another_the_highest_is_nearest() -> None:
    builder = SceneBuilder().add("floor", (0, 0, 0), (4, 3, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("rug", (1, 1, 0), (3, 2, 0.01)).add("table", (1.5, 1, 0), (2.5, 2, 0.7))
    truth = truth_of(builder.add("wall", (1, 1, 2), (3, 2, 2.5)).build())
    assert truth.nearest(2.0, 1.5) == "table"
    assert truth.nearest(1.1, 1.5) == "rug"


def test_an_empty_room_has_no_nearest_object() -> None:
    bare = SceneBuilder().add("floor", (0, 0, 0), (4, 3, 2.5), sides=("z-", *WALL_SIDES)).build()
    assert truth_of(bare).nearest(1.0, 1.0) == ""


def test_an_unnamed_nearest_object_gives_no_name() -> None:
    scene = divided_room(("object", (1, 1, 0), (1.5, 1.5, 0.5)), BED)
    assert truth_of(scene).nearest(1.2, 1.2) == ""
    assert truth_of(scene).nearest(5.0, 1.2) == "bed"


def test_any_category_of_an_apartment_is_answered_from_its_start() -> None:
    scene = generate_apartment(1)
    truth = truth_of(scene)
    for category in scene.categories[::4]:
        found = truth.distances(category, *scene.start[:2])
        assert found.path_m < 50.0, category
        again = truth.distances(category, *scene.start[:2])
        assert again == found


def test_what_is_already_near_needs_no_path() -> None:
    assert truth_of(box_room()).distances("ball", 2.0, 0.5).path_m == 0.0


def test_unknown_names_and_unreachable_objects_are_infinitely_far() -> None:
    found = truth_of(box_room()).distances("elephant", 1.0, 1.0)
    assert (found.instances, found.straight_line_m, found.path_m) == (0, np.inf, np.inf)
    builder = SceneBuilder().add("floor", (0, 0, 0), (8, 3, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("wall", (3.9, 0, 0), (4.1, 3, 2.5)).add("bed", (6.5, 1, 0), (7.5, 2, 0.5))
    found = truth_of(builder.build()).distances("bed", 1.0, 1.0)
    assert found.straight_line_m == pytest.approx(5.5)
    assert found.path_m == np.inf


def test_from_within_a_wall_there_is_no_path() -> None:
    assert truth_of(divided_room()).distances("bed", 3.0, 1.0).path_m == np.inf


@settings(max_examples=50, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**16))
def test_horizontal_distance_agrees_with_many_points_on_the_triangles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(-1, 1, (3, 3, 3))
    place = rng.uniform(-2, 2, 2)
    weights = rng.dirichlet((0.4, 0.4, 0.4), 20000)
    points = np.einsum("nk,tkd->tnd", weights, triangles)[..., :2]
    sampled = float(np.linalg.norm(points - place, axis=2).min())
    assert horizontal_distances(triangles, place).min() == pytest.approx(sampled, abs=0.05)


def test_the_shortest_path_leads_around_the_wall_to_a_success_place() -> None:
    truth = truth_of(divided_room())
    path = truth.shortest_path("bed", 1.0, 1.0)
    np.testing.assert_allclose(path[0], (1.0, 1.0), atol=0.05)
    assert path[:, 1].max() > 2.9  # through the door
    assert truth.distances("bed", float(path[-1, 0]), float(path[-1, 1])).path_m == 0
    assert len(truth.shortest_path("sofa", 1.0, 1.0)) == 0
    assert len(truth.shortest_path("bed", 50.0, 1.0)) == 0


def test_the_least_way_between_two_categories() -> None:
    sofa: Box = ("sofa", (0.2, 0.2, 0.0), (1.0, 1.0, 0.5))
    chair: Box = ("chair", (4.6, 0.4, 0.0), (4.9, 0.8, 0.9))
    truth = truth_of(divided_room(BED, sofa, chair))
    assert truth.least_way_m("bed", "chair") == 0.0
    assert 3.0 < truth.least_way_m("sofa", "bed") < 8.0
    assert truth.least_way_m("sofa", "toilet") == np.inf
