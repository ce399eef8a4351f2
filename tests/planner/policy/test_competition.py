"""What fits another name better is not the object, and what was found is not found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.policy.names import conflicting_object, count_contradictions, rival_names
from onemap_planner.policy.state import MAX_FOUND_OBJECTS, FoundObject, PlannerState
from onemap_planner.search.state_machine import EventStamp, Finished, new_search
from onemap_planner.searches import SearchRegistry
from onemap_planner.world.candidates import ObjectCandidate, Sighting, sightings_of
from onemap_planner.world.map_view import MapView
from onemap_shared.clock import SystemClock
from onemap_shared.messages import MAX_RIVALS, Detections, SearchState
from tests.planner.drawn_maps import detections_of, drawn_map
from tests.planner.grid_world import GridWorld, in_one_room, start

STAMP = EventStamp(0.0, 0.0, (1.0, 1.0), 0.0)
BED = frozenset((x, y) for x in range(4, 14) for y in range(4, 12))
BED_END = frozenset((x, y) for x in range(4, 8) for y in range(4, 12))
PILLOW = frozenset((x, y) for x in range(14, 16) for y in range(6, 9))


def candidate(cells: frozenset[tuple[int, int]], sightings: int = 3) -> ObjectCandidate:
    x, y = np.mean(sorted(cells), axis=0) / 10
    return ObjectCandidate((x, y, 0.5), cells, sightings, 0.9, 0.9, ((0.0, 0.0),))


def map_view_where(
    own: dict[tuple[int, int], float], rival: dict[tuple[int, int], float]
) -> MapView:
    """20 x 20 cells of 0.1 m with these scores of the target and of its best rival."""
    similarity, best = (np.full((20, 20), 0.05, np.float32) for _ in range(2))
    for cells, grid in ((own, similarity), (rival, best)):
        for cell, score in cells.items():
            grid[cell] = score
    return replace(drawn_map(*["." * 20] * 20), similarity=similarity, margin=similarity - best)


def message(**cells_of: frozenset[tuple[int, int]]) -> Detections:
    """One detection per name, a point in the middle of each of its cells."""
    return detections_of(
        {
            name: [((x + 0.5) / 10, (y + 0.5) / 10, 0.5) for x, y in cells]
            for name, cells in cells_of.items()
        }
    )


def test_rivals_are_the_other_names_and_the_found_objects() -> None:
    found_objects = (
        FoundObject("Bed", BED),
        FoundObject("toilet", PILLOW),
        FoundObject("sofa", BED),
    )
    assert rival_names("sofa", ("bed", "Sofa", "desk"), found_objects) == (
        "bed",
        "desk",
        "toilet",
        "Bed",
    )
    assert rival_names("sofa", ("sofa",), ()) == ()
    many = tuple(f"thing {n}" for n in range(2 * MAX_RIVALS))
    assert rival_names("sofa", many, ()) == many[:MAX_RIVALS]


def test_a_candidate_on_a_found_object_is_it_where_its_name_fits_better() -> None:
    found_objects = (FoundObject("bed", BED),)
    # The end of the bed looks like a sofa, the bed as a whole does not.
    end = map_view_where(dict.fromkeys(BED_END, 0.9), dict.fromkeys(BED - BED_END, 0.9))
    assert conflicting_object(candidate(BED_END), found_objects, end) == found_objects[0]
    assert conflicting_object(candidate(BED_END), (), end) is None
    # The found object was the error: all of it resembles a sofa by now.
    wrong = map_view_where(dict.fromkeys(BED, 0.9), dict.fromkeys(BED, 0.3))
    assert conflicting_object(candidate(BED_END), found_objects, wrong) is None


def test_a_candidate_beside_or_on_a_found_object_is_another() -> None:
    map_view = map_view_where(dict.fromkeys(PILLOW, 0.9), dict.fromkeys(BED, 0.9))
    assert conflicting_object(candidate(PILLOW), (FoundObject("bed", BED),), map_view) is None


def test_found_objects_are_kept_up_to_a_limit_from_one_search_to_the_next() -> None:
    state = PlannerState(new_search("a", ("bed",), STAMP, 0))
    for _ in range(MAX_FOUND_OBJECTS + 3):
        state.find(candidate(PILLOW))
    found = FoundObject("bed", PILLOW, candidate(PILLOW).xyz[2])
    assert state.found_objects == (found,) * MAX_FOUND_OBJECTS
    registry = SearchRegistry(SystemClock())
    registry.start(new_search("a", ("bed",), STAMP, 0))
    taken = registry.state
    assert taken is not None
    over = replace(taken.search, phase=Finished(SearchState.FOUND))
    known = replace(taken, search=over, found_objects=(FoundObject("bed", BED),), known_m2=40.0)
    registry.compare_and_swap(taken, known)
    registry.start(new_search("b", ("sofa",), STAMP, 0))
    assert registry.state is not None
    assert (registry.state.found_objects, registry.state.known_m2) == (
        (FoundObject("bed", BED),),
        40.0,
    )
    registry.clear_found_objects()
    assert registry.state.found_objects == ()


@pytest.mark.parametrize(
    ("seen", "contradictions"),
    [
        pytest.param({"bed": BED}, 1, id="another name in its place"),
        pytest.param({"bed": frozenset({(0, 0)})}, 0, id="another name elsewhere"),
        pytest.param({"sofa": BED, "bed": BED}, 0, id="seen itself in the same frame"),
        pytest.param({}, 0, id="nothing"),
    ],
)
def test_frames_with_another_name_there_are_counted(
    seen: dict[str, frozenset[tuple[int, int]]], contradictions: int
) -> None:
    map_view = map_view_where(dict.fromkeys(BED, 0.9), {})
    frame = message(**seen)
    own: tuple[Sighting, ...] = sightings_of("sofa", frame, map_view, seen_from=(0, 0))
    (after,) = count_contradictions(
        (candidate(BED),), frame, own, names=("sofa",), map_view=map_view
    )
    assert after.contradictions == contradictions


class Confused(GridWorld):
    """The detector and the map take a bed for a sofa as well, a little less surely."""

    def detect(self, text: str, seen: np.ndarray) -> Detections:
        detections = super().detect("bed" if text == "sofa" else text, seen)
        return replace(detections, names=tuple(text for _ in detections.names))


@pytest.mark.slow
def test_one_object_is_not_found_under_two_names() -> None:
    plain = in_one_room()
    world = Confused(plain.floor_plan, plain.pose)
    world.likeness["sofa"] = world.likeness["bed"] * np.float32(0.9)
    run = start(world, "bed", "sofa")
    search = run.until_over(400.0)
    outcomes = {result.name: result.outcome for result in search.results}
    assert outcomes == {"bed": SearchState.FOUND, "sofa": SearchState.NOT_FOUND}, run.reasons
    assert "which is the bed found before" in search.results[1].reason
