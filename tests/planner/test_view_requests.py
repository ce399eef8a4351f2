"""Views are kept, and asked for as what changed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from onemap_planner.planning_thread import ViewRequests
from onemap_planner.world.map_view import AssembledView, map_view_around, with_changes
from onemap_shared import keys
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    NO_VIEW,
    Layer,
    Occupancy,
    SearchView,
    SearchViewRequest,
    ViewChanges,
    ViewChangesRequest,
    ViewKey,
)
from onemap_shared.transport import NoReply, RemoteError
from tests.memory_bus import MemoryRouter

GRID = GridSpec(0.1, (-64, 0), (128, 64))
SOFA = SearchViewRequest("sofa", ("bed",))
LIMITS = np.linspace(-1, 1, 254, dtype=np.float32)


def changes(
    request: ViewChangesRequest, key: ViewKey, cell: int = 5, *, base: ViewKey | None = None
) -> ViewChanges:
    """One cell of the tile at the origin is seen, free and like the text."""
    mask = np.zeros(4096, bool)
    mask[cell] = True
    return ViewChanges(
        text=request.text,
        base=request.have if base is None else base,
        key=key,
        revision=key.number,
        sequence=0,
        stamp_ns=1,
        grid=GRID,
        tiles=np.array([[0, 0]], np.int32),
        cells=np.packbits(mask)[None],
        occupancy=np.array([Occupancy.FREE], np.uint8),
        layers=np.array([Layer.OBSERVED], np.uint8),
        values=np.array([[0.5], [0.25], [0.125]], np.float32),
        rank_limits=LIMITS,
    )


class SimulatedMapper:
    """Answers as it is told, and keeps what it was asked."""

    def __init__(self) -> None:
        self.asked: list[ViewChangesRequest] = []
        self.answer: Callable[[ViewChangesRequest], ViewChanges] = self.one_cell
        self.router = router = MemoryRouter()
        self.bus = router.bus("mapper")
        self.bus.serve(keys.MAP_VIEW_CHANGES, self.reply)
        self.requests = ViewRequests(router.bus("planner"), 10.0)

    def reply(self, request: ViewChangesRequest) -> ViewChanges:
        self.asked.append(request)
        return self.answer(request)

    def one_cell(self, request: ViewChangesRequest) -> ViewChanges:
        number = request.have.number + 1
        return changes(request, ViewKey("m", "1.2", number), cell=number)


def test_the_second_view_is_asked_for_as_what_changed() -> None:
    mapper = SimulatedMapper()
    views = [mapper.requests.view(SOFA) for _ in range(3)]
    assert [request.have for request in mapper.asked] == [
        NO_VIEW,
        ViewKey("m", "1.2", 1),
        ViewKey("m", "1.2", 2),
    ]
    assert all(request.text == "sofa" and request.rivals == ("bed",) for request in mapper.asked)
    assert (mapper.requests.whole, mapper.requests.changed) == (1, 2)
    known = [np.count_nonzero(view.occupancy) for view in views]
    assert known == [1, 2, 3]  # and the earlier views stay as they were


def test_changes_of_another_view_are_asked_for_anew() -> None:
    mapper = SimulatedMapper()
    mapper.requests.view(SOFA)

    def confused(request: ViewChangesRequest) -> ViewChanges:
        base = ViewKey("m", "1.2", 7) if request.have != NO_VIEW else NO_VIEW
        return changes(request, ViewKey("m", "1.2", 9), base=base)

    mapper.answer = confused
    view = mapper.requests.view(SOFA)
    assert isinstance(view, AssembledView)
    assert view.key.number == 9
    assert [request.have.number for request in mapper.asked] == [0, 1, 0]
    mapper.answer = lambda request: changes(request, view.key, base=ViewKey("m", "1.2", 7))
    with pytest.raises(RemoteError, match="lead on from another view, though the whole"):
        mapper.requests.view(SOFA)


def test_a_mapper_of_an_earlier_release_sends_whole_views() -> None:
    router = MemoryRouter()
    requests = ViewRequests(router.bus("planner"), 10.0)
    with pytest.raises(NoReply):
        requests.view(SOFA)
    layer = np.zeros((2, 2), np.uint8)
    whole = SearchView(
        "sofa", 1, 1, 1, GridSpec(0.1, (0, 0), (2, 2)), layer, layer, np.ones((2, 2), np.float32)
    )
    router.bus("mapper").serve(keys.MAP_SEARCH_VIEW, lambda _: whole)
    assert isinstance(requests.view(SOFA), SearchView)
    assert (requests.whole, requests.changed) == (1, 0)


def test_a_mapper_that_comes_back_procedure_by_procedure_sends_what_changed() -> None:
    mapper = SimulatedMapper()
    mapper.requests.view(SOFA)
    mapper.bus.close()
    bus = mapper.router.bus("mapper")
    bus.serve(keys.MAP_SEARCH_VIEW, lambda _: pytest.fail("the whole view was asked for"))
    with pytest.raises(NoReply):
        mapper.requests.view(SOFA)
    bus.serve(keys.MAP_VIEW_CHANGES, mapper.reply)
    mapper.requests.view(SOFA)
    assert (mapper.requests.whole, mapper.requests.changed) == (1, 1)


def test_a_window_of_an_assembled_view_is_that_of_the_whole_one() -> None:
    request, view = ViewChangesRequest("sofa", ("bed",)), None
    rng = np.random.default_rng(0)
    for number in range(1, 30):
        base = NO_VIEW if view is None else view.key
        cell = int(rng.integers(4096))
        view = with_changes(view, changes(request, ViewKey("m", "1.2", number), cell, base=base))
    assert view is not None
    windows = [None, np.array([[1.0, 1.0], [2.0, 3.0]]), np.array([[9.0, 9.0], [12.0, 12.0]])]
    for window in windows:
        for robot in (np.array([3.0, 3.0]), np.array([-20.0, 1.0])):
            ours, theirs = (map_view_around(each, robot, window) for each in (view, view.whole()))
            assert ours.grid == theirs.grid
            for name in ("occupancy", "observed", "similarity", "margin", "guidance", "assumed"):
                np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
