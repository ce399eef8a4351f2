from __future__ import annotations

import struct
from dataclasses import replace

import numpy as np

from onemap_ros2 import cdr
from onemap_ros2.config import Ros2Config
from onemap_ros2.display import TOPICS, VIEWS, Display
from onemap_ros2.display_messages import (
    marker_array,
    occupancy_grid,
    similarity_grid,
)
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.grid import GridSpec
from onemap_shared.transport import RequestRejected
from tests.memory_bus import MemoryRouter
from tests.ros2.fake_network import FakeNetwork, FakeWriter
from tests.ros2.planner_messages import KEPT, path_to, status, view

CONFIG = Ros2Config.model_validate({"namespace": "/r1"})


class Screen:
    """A display between a mapper and a planner in memory and a robot's network in memory."""

    def __init__(self) -> None:
        router = MemoryRouter()
        self.mapper = router.bus("mapper")
        self.asked: list[str] = []
        self.mapper.serve(keys.MAP_SEARCH_VIEW, self._view)
        self.mapper.serve(keys.MAP_OBJECTS, self._objects)
        self.revisions = self.mapper.publish(keys.MAP_REVISION)
        self.paths, self.states = (
            self.mapper.publish(keys.SEARCH_PATH),
            self.mapper.publish(keys.SEARCH_STATE),
        )
        self.network = FakeNetwork()
        self.now_s = 10.0
        self.display = Display(router.bus("ros2"), self.network, CONFIG, lambda: 77)

    def _view(self, request: m.SearchViewRequest) -> m.SearchView:
        self.asked.append(request.text)
        if request.text == "xyzzy":
            raise RequestRejected("unknown_word", "no such word")
        return view()

    def run(self, seconds: int, *, revise: bool = True) -> None:
        """Steps of a tenth of a second; the map changes in each, though not its occupancy."""
        for _ in range(10 * seconds):
            self.now_s += 0.1
            if revise:
                self.revise(0)
            self.display.step(self.now_s)

    def query(self, word: str) -> None:
        self.network.say("/r1/onemap/query", cdr.encode(cdr.new(cdr.STRING, word), cdr.STRING))

    def _objects(self, _: m.ObjectListRequest) -> m.ObjectList:
        self.asked.append("objects")
        return m.ObjectList((KEPT,))

    def writer(self, name: str) -> FakeWriter:
        return self.network.writers[f"/r1/onemap/{name}", TOPICS[name]]

    def revise(self, objects_version: int, places_version: int = 0) -> None:
        revision = m.MapRevision(1, 1, 1, "e", "t", 1, 1, 1, 1.0, 1.0, objects_version)
        self.revisions.put(replace(revision, places_version=places_version))


def test_views_show_the_present_object_at_a_bounded_rate_and_what_changed() -> None:
    screen = Screen()
    screen.states.put(status("s1"))
    screen.run(3)
    assert screen.asked.count("sofa") == 3
    sent = {name: len(screen.writer(name).sent) for name in VIEWS}
    assert sent == {"map": 1, "similarity": 3}
    assert cdr.decode(screen.writer("map").sent[0], cdr.GRID).info.width == 3
    screen.run(3, revise=False)
    assert screen.asked.count("sofa") == 4  # once for the last revision


def test_who_listens_later_gets_the_view_though_nothing_changed() -> None:
    screen = Screen()
    similarity = screen.writer("similarity")
    similarity.has_subscribers = False
    screen.run(2, revise=False)
    assert (len(screen.writer("map").sent), similarity.sent) == (1, [])
    similarity.has_subscribers = True
    screen.run(2, revise=False)
    assert (len(screen.writer("map").sent), len(similarity.sent)) == (1, 1)


def test_a_word_is_shown_until_an_empty_one_and_an_unknown_one_hides_nothing() -> None:
    screen = Screen()
    screen.states.put(status("s1"))
    asked = []
    for word in ("lamp", "", "xyzzy", "7 " * 99):
        screen.query(word)
        screen.asked.clear()
        screen.run(2)
        asked.append([text for text in screen.asked if text != "objects"])
    assert asked == [["lamp"] * 2, ["sofa"] * 2, ["xyzzy", "sofa"], ["sofa"] * 2]


def test_nothing_is_asked_while_nobody_listens() -> None:
    screen = Screen()
    for writer in screen.network.writers.values():
        writer.has_subscribers = False
    screen.revise(1)
    screen.paths.put(path_to(2.0, 0.0))
    for step in range(30):
        screen.display.step(10.0 + 0.1 * step)
    assert screen.asked == []
    assert not any(writer.sent for writer in screen.network.writers.values())


def test_marks_follow_the_plan_and_the_objects_at_a_bounded_rate() -> None:
    screen = Screen()
    for name in VIEWS:
        screen.writer(name).has_subscribers = False
    screen.states.put(status("s1"))
    screen.revise(1)
    for step in range(20):
        screen.paths.put(path_to(2.0, 0.0))
        screen.display.step(10.0 + 0.1 * step)
    assert screen.asked == ["objects"]  # the list has not changed since
    assert len(screen.writer("markers").sent) == 4  # 2 Hz for 2 s
    path = cdr.decode(screen.writer("path").sent[-1], cdr.PATH)
    assert (path.poses[-1].pose.position.x, cdr.stamp_ns(path.header.stamp)) == (2.0, 77)
    screen.revise(2)
    screen.states.put(status("s1", m.SearchState.FOUND))
    screen.display.step(20.0)
    markers = cdr.decode(screen.writer("markers").sent[-1], cdr.MARKER_ARRAY).markers
    assert {each.ns for each in markers} == {"", "finds"}  # the plan is over
    assert len(cdr.decode(screen.writer("path").sent[-1], cdr.PATH).poses) == 0
    sent = len(screen.writer("markers").sent)
    screen.display.step(30.0)
    assert len(screen.writer("markers").sent) == sent  # nothing is new


def test_nav2_gets_the_zones_and_the_places_to_stay_out_of() -> None:
    screen = Screen()
    zone = m.Place("zone", m.PlaceKind.KEEP_OUT, corners_m=((1.1, 0.1), (1.9, 0.1), (1.9, 0.9)))
    rug = m.Place("rug", corners_m=((-1.9, 0.1), (-1.1, 0.1), (-1.1, 0.9)))
    places = [zone, rug]

    def served(_: m.PlacesRequest) -> m.MapPlaces:
        grid = GridSpec(0.5, (0, 0), (2, 2))
        ids = np.full(grid.shape, m.NO_ROOM, np.int32)
        return m.MapPlaces(len(places), 1, tuple(places), (m.NO_ROOM,) * len(places), grid, ids)

    screen.mapper.serve(keys.MAP_PLACES, served)
    screen.revise(0, 2)
    screen.display.step(10.0)
    (mask,) = (cdr.decode(data, cdr.GRID) for data in screen.writer("keepout_mask").sent)
    (info,) = (cdr.decode(data, cdr.FILTER_INFO) for data in screen.writer("keepout_info").sent)
    x_m, y_m = mask.info.origin.position.x, mask.info.origin.position.y
    lethal = np.argwhere(mask.data.reshape(mask.info.height, mask.info.width) == 100)[:, ::-1]
    centres = (lethal + 0.5) * mask.info.resolution + (x_m, y_m)
    assert {(1.25, 0.25), (1.75, 0.25), (1.75, 0.75)} <= set(map(tuple, centres.tolist()))
    assert centres.min() > 0.0
    assert (info.type, info.base, info.multiplier) == (0, 0.0, 1.0)
    assert info.filter_mask_topic == "/r1/onemap/keepout_mask"
    screen.display.step(10.1)
    screen.states.put(replace(status("s1"), stay_out=("Rug",)))
    screen.display.step(10.2)
    assert len(screen.writer("keepout_info").sent) == 1
    mask = cdr.decode(screen.writer("keepout_mask").sent[-1], cdr.GRID)
    assert len(screen.writer("keepout_mask").sent) == 2
    assert np.count_nonzero(mask.data == 100) > len(lethal)


def golden(values: bytes) -> bytes:
    """The message as ``struct`` builds it: 3 columns along x, 2 rows along y."""
    body = struct.pack("<iII4s", 0, 5, 4, b"map\0")
    body += struct.pack("<iIfII", 0, 5, 0.5, 3, 2)
    body += bytes(-len(body) % 8) + struct.pack("<7d", -1.0, 2.0, 0, 0, 0, 0, 1)
    return bytes((0, 1, 0, 0)) + body + struct.pack("<I", len(values)) + values


def test_grids_have_their_rows_along_y_lowest_first() -> None:
    percent = struct.pack("6b", -1, 100, -1, 25, 0, 50)  # -1 where nothing was observed
    assert similarity_grid(view(), "map") == golden(percent)
    assert occupancy_grid(view(), "map") == golden(struct.pack("6b", -1, 0, 0, 0, 100, 0))


def test_without_a_word_no_cell_is_similar() -> None:
    without = replace(view(), similarity=view().similarity[:0, :0])
    assert set(cdr.decode(similarity_grid(without, "map"), cdr.GRID).data) == {-1}


def test_markers_show_finds_regions_and_frontiers_after_deleting_all() -> None:
    message = cdr.decode(marker_array([KEPT], path_to(2.0, 0.0), 7, "map"), cdr.MARKER_ARRAY)
    first, *rest = message.markers
    assert first.action == 3
    assert [(each.ns, each.id, each.type) for each in rest] == [
        ("finds", 0, 2),
        ("finds", 1, 9),
        ("regions", 0, 3),
        ("regions", 1, 3),
        ("frontiers", 0, 7),
    ]
    sphere, label, low, high, frontiers = rest
    assert (sphere.pose.position.x, sphere.pose.position.z) == (1.0, 0.4)
    assert label.text == "sofa"
    assert low.color.a < high.color.a
    assert [(point.x, point.y) for point in frontiers.points] == [(1.0, 1.0), (3.0, 1.0)]
    assert {each.header.frame_id for each in rest} == {"map"}
    assert all(each.action == 0 and each.scale.x > 0 and each.color.a > 0 for each in rest)
