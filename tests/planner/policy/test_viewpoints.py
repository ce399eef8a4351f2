"""Viewpoints are reachable, within their distances, and see the target if any does."""

from dataclasses import replace

import numpy as np
import pytest

from onemap_mapper.frame.camera_check import camera_view
from onemap_planner.inputs import LatestInputs, with_revision
from onemap_planner.motion.motions import STOP, Drive, Pose2d
from onemap_planner.policy import context, viewpoints
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.step import step
from onemap_planner.search.state_machine import Approaching
from onemap_planner.world.candidates import SAME_SIDE_M, Sighting
from onemap_shared.geometry import I64, camera_mount
from onemap_shared.messages import CameraView, MapRevision
from onemap_simulator.rendering.rgbd_camera import CameraParams
from tests.mapper import scenes
from tests.planner import one_room
from tests.planner.drawn_maps import PARAMS, drawn_map, search_view_of


def around(
    target: list[list[int]],
    tried: list[list[int]] | None = None,
    seen_from: list[list[int]] | None = None,
) -> viewpoints.Viewpoints:
    """Viewpoints left of a wall (cells 30 to 39), for a target in it or right of it."""
    map_view = drawn_map(*["......##......"] * 4, scale=5)
    here = one_room.standing(map_view, (0.5, 0.5))
    vain, seen = (np.array(cells or [], np.int64).reshape(-1, 2) for cells in (tried, seen_from))
    target_seen = viewpoints.SightTarget(np.array(target), seen)
    return viewpoints.viewpoints_around(target_seen, here, (0.5, 1.4), tried=vain)


def test_nothing_is_seen_through_a_wall_unless_it_was_seen_from_there() -> None:
    assert viewpoints.first_visible(around([[10, 39]])) is None
    viewpoint = viewpoints.first_visible(around([[10, 39]], seen_from=[[10, 5]]))
    assert viewpoint is not None
    assert viewpoint[1] < 30


def test_a_room_that_cannot_be_reached_is_not_looked_into_through_its_wall() -> None:
    assert viewpoints.least_occluded(around([[10, 39]])) is None


def beside_a_wall(target: list[int], seen_from: list[list[int]]) -> I64 | None:
    """The viewpoint of a thing on a counter (rows 20 to 24) at a thin wall (25, 26).

    The robot stands in the room behind the wall, which a door connects with the counter's.
    """
    rows = [*["." * 60] * 20, *["#" * 40 + "." * 20] * 7, *["." * 60] * 20]
    here = one_room.standing(drawn_map(*rows), (3.5, 1.0))
    seen = np.array(seen_from, np.int64).reshape(-1, 2)
    there = viewpoints.SightTarget(np.array([target]), seen)
    return viewpoints.first_visible(viewpoints.viewpoints_around(there, here, (0.5, 1.5)))


@pytest.mark.parametrize(
    ("target", "seen_from", "behind"),
    [
        pytest.param([22, 10], [], False, id="nearer to the counter's room"),
        pytest.param([24, 10], [[5, 10]], False, id="seen over the counter"),
        pytest.param([24, 10], [], True, id="nothing tells which room"),
    ],
)
def test_what_stands_at_a_wall_is_not_looked_at_from_the_next_room(
    target: list[int], seen_from: list[list[int]], behind: bool
) -> None:
    viewpoint = beside_a_wall(target, seen_from)
    assert viewpoint is not None
    assert bool(viewpoint[0] > 26) is behind


@pytest.mark.parametrize(("seen_from", "behind"), [([[2, 10]], False), ([], True)])
def test_what_was_seen_over_the_unknown_is_not_looked_at_through_a_wall(
    seen_from: list[list[int]], behind: bool
) -> None:
    """A thing at a thin wall, in a room of which the map has no floor yet but far from it."""
    rows = [*["." * 60] * 4, *[" " * 40 + "." * 20] * 18, *["#" * 40 + "." * 20] * 5]
    rows += ["." * 60] * 20
    here = one_room.standing(drawn_map(*rows), (3.5, 1.0))
    seen = np.array(seen_from, np.int64).reshape(-1, 2)
    target = viewpoints.SightTarget(np.array([[22, 10]]), seen)
    around = viewpoints.viewpoints_around(target, here, (0.5, 1.5))
    assert bool(len(around.cells)) is behind


def test_another_side_is_in_sight_and_not_where_it_was_looked_at_before() -> None:
    seen = one_room.candidate(2.5, 2.5)
    first = viewpoints.find_viewpoint(seen, one_room.context())
    assert first is not None
    other = viewpoints.find_viewpoint(seen, one_room.context(), [first])
    assert other is not None
    assert np.hypot(other[0] - first[0], other[1] - first[1]) > viewpoints.TRIED_M
    doubtful = replace(seen, supported=False)
    side = viewpoints.find_viewpoint(doubtful, one_room.context(), [first])
    assert side is not None
    assert np.hypot(side[0] - first[0], side[1] - first[1]) > SAME_SIDE_M
    inside_the_wall = one_room.candidate(2.0, 3.9)
    hidden = viewpoints.find_viewpoint(inside_the_wall, one_room.context(), [first])
    assert (
        hidden is None or np.hypot(hidden[0] - first[0], hidden[1] - first[1]) > viewpoints.TRIED_M
    )


def test_beyond_the_bands_there_is_another_view_too() -> None:
    """A long thing at the wall behind 1.2 m that nobody can stand on."""
    room = drawn_map("#" * 8, *["#....  #"] * 6, "#" * 8, scale=5)
    here = one_room.context_of(search_view_of(room), Pose2d(1.0, 1.0, 0.0))
    cells = frozenset((x, 37) for x in range(8, 32))
    recent = (Sighting((2.0, 3.6, 0.5), cells, 0.9, 0.8, (2.0, 2.0)),)
    seen = replace(one_room.candidate(2.0, 3.6), cells=cells, recent=recent)
    tried = list[tuple[float, float]]()
    while (viewpoint := viewpoints.find_viewpoint(seen, here, tried)) is not None:
        assert 3.75 - viewpoint[1] <= context.APPROACH_LIMIT_M
        assert 3.75 - viewpoint[1] > context.APPROACH_LAST_RESORT_M
        away = [np.hypot(*np.subtract(viewpoint, before)) for before in tried]
        assert min(away, default=np.inf) > viewpoints.TRIED_M - 0.01
        tried.append(viewpoint)
    assert len(tried) > 1
    doubtful = replace(seen, supported=False)
    assert viewpoints.find_viewpoint(doubtful, here) is None


BANDS = context.Bands(camera=CameraView(1.0, 45.0, 20.0))


@pytest.mark.parametrize(
    ("height_m", "nearest_m"),
    [
        (0.6, 0.7),  # in the image from 0.4 m on
        (0.2, 0.8),  # the camera looks over it
        (0.0, 0.9),  # as far as the band allows
        (1.1, 0.7),
        (1.3, 0.824),  # the camera looks under it
        (2.0, 0.9),
        (float("nan"), 0.7),
    ],
)
def test_the_height_of_an_object_decides_from_how_near_it_is_looked_at(
    height_m: float, nearest_m: float
) -> None:
    first, last_resort, _ = BANDS.at(height_m)
    assert first[0] == pytest.approx(nearest_m, abs=1e-3)
    assert last_resort[0] >= first[0]
    assert (first[1], last_resort[1]) == (1.1, 1.25)


def metres_before_it(height_m: float, camera: tuple[CameraView, ...]) -> float:
    """From how near a robot with this camera sets out to look at a thing of this height."""
    seen = replace(one_room.candidate(1.55, 1.55), xyz=(1.55, 1.55, height_m))
    state = one_room.planner_state(seen)
    state.search = replace(state.search, phase=Approaching(seen))
    told = MapRevision(1, 1, 0, "e", "s", 1, 1, 1, 1.0, 1.0, camera=camera)
    inputs = with_revision(LatestInputs(), told, 0.0)
    here = Observation(
        0.0, one_room.POSE, 0.0, STOP, False, one_room.ROOM, (), "", camera=inputs.camera
    )
    decision = step(state, here, PARAMS).decision
    assert decision is not None
    assert isinstance(decision.motion, Drive)
    return float(np.hypot(*(decision.motion.points_xy[-1] - 1.55)))


def test_a_robot_looks_from_where_its_own_camera_sees() -> None:
    low, tilted = (
        camera_view(scenes.field(1, camera_mount(0.0, height_m, np.deg2rad(down_deg))))
        for height_m, down_deg in ((0.4, 0.0), (1.3, 32.0))
    )
    on_floor, on_table, on_shelf = (
        [metres_before_it(height_m, camera) for camera in ((), (low,), (tilted,))]
        for height_m in (0.05, 0.9, 1.4)
    )
    assert on_floor[0] > 0.89  # the usual camera looks over it, the others do not
    assert max(on_floor[1:]) < 0.85
    assert max(on_table) < 0.85
    assert min(on_shelf) > 0.89  # all of them look under it


def test_the_usual_camera_is_the_simulators() -> None:
    camera = CameraParams()
    half_deg = np.degrees(np.arctan(camera.height / 2 / camera.intrinsics.fy))
    assert context.USUAL_CAMERA.height_m == camera.height_m
    assert context.USUAL_CAMERA.across_deg == camera.horizontal_fov_deg
    assert context.USUAL_CAMERA.down_deg == pytest.approx(half_deg + camera.pitch_down_deg, abs=1.0)
    assert context.USUAL_CAMERA.up_deg == pytest.approx(half_deg - camera.pitch_down_deg, abs=1.0)


@pytest.mark.parametrize(("supported", "reached"), [(True, True), (False, False)])
def test_where_the_robot_fits_nowhere_nearer_it_looks_from_as_near_as_it_can(
    supported: bool, reached: bool
) -> None:
    rows = [*["#" * 40] * 5, *[f"#{'.' * 38}#"] * 20, *["#" * 40] * 5]
    rows[5:13] = rows[17:25] = [f"#{'.' * 20}{'#' * 15}...#"] * 8  # a passage of 0.4 m
    view = search_view_of(drawn_map(*rows))
    pose = Pose2d(1.4, 1.0, 0.0)
    here = one_room.context_of(view, pose)
    seen = replace(one_room.candidate(1.45, 3.15), supported=supported, seen_from=((1.4, 1.0),))
    viewpoint = viewpoints.find_viewpoint(seen, here)
    assert (viewpoint is not None) is reached
    if viewpoint is not None:
        assert 1.25 <= np.hypot(viewpoint[0] - 1.45, viewpoint[1] - 3.15) <= 1.5
