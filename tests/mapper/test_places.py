"""Named places: kept whatever happens, in the room that holds them, moved with a merged map."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.places.keeper import FORM, PlaceKeeper
from onemap_mapper.places.memory import PlaceMemory, from_bytes, to_bytes
from onemap_mapper.places.rooms import Rooms
from onemap_mapper.storage.kept import Kept as FileKept
from onemap_mapper.storage.kept import unsealed
from onemap_mapper.storage.objects import NO_OBJECTS, ObjectMemory
from onemap_mapper.storage.planar_motion import NO_MOTION, PlanarMotion
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.atomic_file import SystemDisk
from onemap_shared.clock import SystemClock
from onemap_shared.geometry import Bool
from onemap_shared.grid import GridSpec
from onemap_shared.places import Zones, place_mask, polygon_mask, room_at
from onemap_shared.transport import RemoteError
from onemap_shared.wire import decode, encode
from tests.mapper import scenes
from tests.mapper.finds import object_find
from tests.mapper.test_rooms import grid_of, plan, rooms
from tests.mapper.test_service import ZONE, Rig
from tests.memory_bus import MemoryRouter

LIST, DRAW = m.PlacesRequest(), m.PlacesChange((ZONE,))
coordinates = st.floats(-100, 100)
points = st.tuples(coordinates, coordinates)


@st.composite
def places(draw: st.DrawFn) -> tuple[m.Place, ...]:
    """Places of different names: points, and triangles that enclose something."""
    names = draw(st.lists(st.sampled_from(["Kitchen", "küche", "nursery", "4 b"]), unique=True))
    found = []
    for name in names:
        kind, (x, y) = draw(st.sampled_from(m.PlaceKind)), draw(points)
        corners = draw(st.sampled_from([(), ((x, y), (x + 1, y), (x, y + 1))]))
        found.append(m.Place(name, kind, () if corners else (x, y), corners))
    return tuple(found)


@given(places(), st.integers(0, 2**40))
def test_what_is_written_is_read(named: tuple[m.Place, ...], version: int) -> None:
    memory = PlaceMemory(named, version)
    assert from_bytes(to_bytes(memory)) == memory


@given(st.data())
def test_damaged_bytes_are_refused_or_harmless(data: st.DataObject) -> None:
    saved = bytearray(to_bytes(PlaceMemory((ZONE,), 3)))
    saved[data.draw(st.integers(0, len(saved) - 1))] = data.draw(st.integers(0, 255))
    with suppress(ValueError):
        assert len(from_bytes(bytes(saved)).places) <= 1


def test_as_many_places_as_allowed_fit_into_file_and_message() -> None:
    corners = tuple((np.cos(a), np.sin(a)) for a in np.arange(m.MAX_CORNERS) / 10)
    names = [chr(0x20000 + n) * m.MAX_TEXT_CHARS for n in range(m.MAX_PLACES)]  # of 4 bytes each
    memory = PlaceMemory(tuple(m.Place(name, corners_m=corners) for name in names))
    assert from_bytes(to_bytes(memory)) == memory
    ids = np.full((1, 1), m.NO_ROOM, np.int32)
    nowhere = (m.NO_ROOM,) * m.MAX_PLACES
    listed = m.MapPlaces(1, 1, memory.places, nowhere, GridSpec(0.1, (0, 0), (1, 1)), ids)
    assert decode(m.MapPlaces, encode(listed)).places == memory.places
    too_many = "would have 101 places, and it may have 100: forget some"
    with pytest.raises(ValueError, match=too_many):
        memory.changed((ZONE,))
    with pytest.raises(ValueError, match=too_many):
        memory.merged((ZONE,), NO_MOTION)
    assert memory.changed((ZONE,), (names[0],)).places[-1] == ZONE  # one goes, one comes


@given(places(), places())
def test_a_merged_map_brings_its_places_turned_and_moved(
    ours: tuple[m.Place, ...], theirs: tuple[m.Place, ...]
) -> None:
    """A quarter turn and whole cells: what a place covers is turned and moved as cells are."""
    moved = PlanarMotion(np.pi / 2, 1.0, -2.0)
    memory, stayed = PlaceMemory(ours).merged(theirs, moved)
    assert memory.places[: len(ours)] == ours
    names = {place.name for place in ours}
    assert set(stayed) <= names & {place.name for place in theirs}
    by_name = {place.name: place for place in memory.places}
    for place in theirs:
        known = by_name[place.name]
        if place.name in names:
            assert known in ours
        elif place.inside_m:
            x, y = place.inside_m
            assert known.inside_m == pytest.approx((1.0 - y, x - 2.0))
        else:
            turned = [(1.0 - y, x - 2.0) for x, y in place.corners_m]
            np.testing.assert_allclose(known.corners_m, turned, atol=1e-9)
    assert memory.merged(memory.places, NO_MOTION) == (memory, ())


class Kept:
    """A keeper on a bus with drawn rooms, and one who asks it."""

    def __init__(self, folder: Path, objects: Iterable[tuple[str, float, float]] = ()) -> None:
        self.rooms = Rooms(1, GridSpec(0.1, (0, 0), (0, 0)), np.zeros((0, 0), np.int32))
        self.objects: ObjectMemory = NO_OBJECTS
        for name, x_m, y_m in objects:
            find = object_find(name, x_m, y_m)
            self.objects = self.objects.with_find(find, str(self.objects.version))
        router = MemoryRouter()
        self.announced: list[int] = []
        self.keeper = PlaceKeeper(
            router.bus("mapper"), folder, self._announce, lambda: self.rooms, lambda: self.objects
        )
        self.client = router.bus()

    def _announce(self) -> None:
        self.announced.append(self.keeper.kept.value.version)

    def name(self, place: m.Place) -> m.MapPlaces:
        return self.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange((place,)))

    def listed(self) -> dict[str, int]:
        """The room of each place by its name, suggestions in capitals."""
        reply = self.client.call(keys.MAP_PLACES, LIST)
        names = [p.name.upper() if p.suggested else p.name for p in reply.places]
        return dict(zip(names, reply.rooms, strict=True))


def drawn(free: Bool, walls: Bool, first_row: int = 0) -> Rooms:
    """The rooms of the rows of a plan from this one on, over their own grid."""
    grid = replace(grid_of(free[first_row:]), origin_cell=(-8 + first_row, 3))
    low = np.zeros_like(free[first_row:])
    return rooms(free[first_row:], low, walls[first_row:], grid)


WEST, EAST = (0.5, 1.5), (6.0, 1.5)  # in the rooms of the plan, whose wall is at 3.25 m


def test_a_room_keeps_its_name_and_grows_with_the_map(tmp_path: Path) -> None:
    kept = Kept(tmp_path)
    kept.name(m.Place("nursery", m.PlaceKind.ROOM, WEST))
    assert kept.listed() == {"nursery": m.NO_ROOM}  # nothing is known there yet
    free, walls = plan()
    covered = []
    for first_row in (25, 0):
        kept.rooms = drawn(free, walls, first_row)
        reply = kept.name(m.Place("Nursery", m.PlaceKind.KEEP_OUT, (2.0, 1.5)))
        assert kept.listed() == {"Nursery": room_at(kept.rooms.ids, kept.rooms.grid, (2.0, 1.5))}
        mask = Zones(reply).mask(grid_of(free))
        np.testing.assert_array_equal(mask, place_mask(reply, "the nursery", grid_of(free)))
        assert not mask[41:].any()
        covered.append(mask.sum())
    np.testing.assert_array_equal(mask[:40], free[:40])
    assert covered[1] > 2 * covered[0]
    assert kept.announced == [1, 2]  # named again as it was: no change


def test_rooms_are_suggested_names_by_what_was_found_there(tmp_path: Path) -> None:
    finds = [("double bed", *WEST), ("sofa", *EAST), ("Bed", 6.0, 4.0), ("nightstand", 6.0, 5.0)]
    kept = Kept(tmp_path, [*finds, ("lamp", *WEST), ("refrigerator", 50.0, 50.0)])
    kept.rooms = drawn(*plan())
    west, east = (room_at(kept.rooms.ids, kept.rooms.grid, at) for at in (WEST, EAST))
    assert kept.listed() == {"BEDROOM": west, "BEDROOM 2": east}
    (suggested, _) = kept.client.call(keys.MAP_PLACES, LIST).places
    assert (suggested.suggested, suggested.kind) == (True, m.PlaceKind.ROOM)
    assert room_at(kept.rooms.ids, kept.rooms.grid, suggested.inside_m) == west
    kept.name(m.Place("bedroom 2", inside_m=WEST, suggested=True))
    assert kept.listed() == {"bedroom 2": west, "BEDROOM": east}
    kept.name(m.Place("The Bedroom", corners_m=ZONE.corners_m))
    assert kept.listed() == {"bedroom 2": west, "The Bedroom": m.NO_ROOM, "BEDROOM 3": east}
    assert kept.announced == [1, 2]  # suggestions are nobody's change


@pytest.mark.parametrize(
    ("named", "forgotten", "code", "reason"),
    [
        ((), "attic", "no_such_place", "no place 'attic'; those that people named are 'Stairs'"),
        ((), "BEDROOM", "no_such_place", "no place 'BEDROOM'; those that people named"),
        (
            (
                m.Place("hall", m.PlaceKind.ROOM, WEST),
                m.Place("a", m.PlaceKind.KEEP_OUT, (50.0, 50.0)),
            ),
            "Stairs",
            "invalid",
            r"no room at \(50.00, 50.00\) m, so that 'a' would keep nothing out",
        ),
    ],
)
def test_a_change_is_made_whole_or_refused_in_a_sentence(
    tmp_path: Path, named: tuple[m.Place, ...], forgotten: str, code: str, reason: str
) -> None:
    kept = Kept(tmp_path, [("bed", *WEST)])
    kept.rooms = drawn(*plan())
    kept.name(ZONE)
    with pytest.raises(RemoteError, match=reason) as refusal:
        kept.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(named, (forgotten,)))
    assert refusal.value.code == code
    assert set(kept.listed()) == {"Stairs", "BEDROOM"}


def stays_after(rig: Rig, folder: Path) -> Rig:
    """Another mapper, after a crash of the one before; its zones are told before a frame comes."""
    after = Rig(folder)
    assert after.newest().places_version == rig.newest().places_version
    return after


def test_a_zone_outlives_a_crash_and_goes_with_its_map(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    assert rig.client.call(keys.MAP_CHANGE_PLACES, DRAW).places == (ZONE,)
    late = rig.router.bus("gateway").subscribe(keys.MAP_REVISION).take(0.0)
    assert late is not None
    assert late.places_version == 1  # latched
    rig = stays_after(rig, tmp_path)
    rig.feed(scenes.field(0, scenes.pose()))
    rig.client.call(keys.MAP_SAVE, m.MapFile("zoned"))
    rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(forgotten=("stairs",)))
    rig = stays_after(rig, tmp_path)  # also that there are none
    rig.feed(scenes.field(0, scenes.pose()))
    rig.client.call(keys.MAP_SAVE, m.MapFile("plain"))
    rig.client.call(keys.MAP_LOAD, m.MapFile("zoned"))
    assert rig.newest().places_version == 3
    assert rig.client.call(keys.MAP_PLACES, LIST).places == (ZONE,)
    rig.client.call(keys.MAP_LOAD, m.MapFile("plain"))
    assert rig.client.call(keys.MAP_PLACES, LIST).places == ()
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)
    rig.client.call(keys.MAP_CLEAR, m.MapClear())
    reply = rig.client.call(keys.MAP_PLACES, LIST)
    assert (reply.places, reply.version) == ((), rig.newest().places_version)
    assert reply.version == 6


def test_a_merged_map_adds_its_zones_and_says_which_stay(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.feed(scenes.field(0, scenes.pose()))
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)
    rig.client.call(keys.MAP_SAVE, m.MapFile("other"))
    merged = rig.client.call(keys.MAP_MERGE, m.MapMerge("other"))
    assert (merged.places_stayed, rig.newest().places_version) == ((), 1)
    merged = rig.client.call(keys.MAP_MERGE, m.MapMerge("other", yaw_rad=np.pi / 2))
    assert merged.places_stayed == ("Stairs",)
    assert rig.client.call(keys.MAP_PLACES, LIST).places == (ZONE,)
    rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(forgotten=("Stairs",)))
    before = rig.newest()
    revisions = rig.router.bus("planner").subscribe(keys.MAP_REVISION, capacity=8)
    rig.client.call(keys.MAP_MERGE, m.MapMerge("other", yaw_rad=np.pi / 2))
    told = [each for each in iter(lambda: revisions.take(0.0), None) if each != before]
    assert told[-1].revision > before.revision
    assert {each.places_version for each in told} == {before.places_version + 1}  # from the first
    (turned,) = rig.client.call(keys.MAP_PLACES, LIST).places
    np.testing.assert_allclose(turned.corners_m, [(0, 0), (0, 2), (-1, 2)], atol=1e-9)
    grid = GridSpec(0.1, (-30, -30), (60, 60))
    here, there = (polygon_mask(np.array(p.corners_m), grid) for p in (ZONE, turned))
    np.testing.assert_array_equal(np.rot90(here), there)  # of [x, y]: to the left


def test_places_of_another_world_are_set_aside(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.feed(replace(scenes.field(0, scenes.pose()), world="home"))
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)
    rig.feed(*(replace(scenes.field(k, scenes.pose()), world="office") for k in range(1, 4)))
    assert rig.client.call(keys.MAP_PLACES, LIST).places == ()
    aside = tmp_path / "other_worlds" / "1" / FORM.file_name
    assert from_bytes(unsealed(aside.read_bytes())).places == (ZONE,)


def garbage(data: bytes) -> bytes:
    return b"nothing" + data[:0]


def cut_off(data: bytes) -> bytes:
    return data[:-3]


def bent(data: bytes) -> bytes:
    """A corner of the zone lies elsewhere: the last byte but one of its last number."""
    return data[:-2] + bytes([data[-2] ^ 1]) + data[-1:]


def refused(rig: Rig, procedure: keys.Procedure[Any, Any], request: Any) -> str:
    with pytest.raises(RemoteError) as refusal:
        rig.client.call(procedure, request)
    return f"{refusal.value.code}: {refusal.value}"


@pytest.mark.parametrize("damage", [garbage, cut_off, bent, None])
def test_places_that_cannot_be_read_are_not_no_places(
    tmp_path: Path, damage: Callable[[bytes], bytes] | None
) -> None:
    """They are not known until a person confirms it, also after another restart."""
    rig, path = Rig(tmp_path), tmp_path / FORM.file_name
    rig.feed(scenes.field(0, scenes.pose()))
    rig.client.call(keys.MAP_SAVE, m.MapFile("plain"))
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)
    whole = path.read_bytes()
    path.unlink()
    if damage is None:
        path.mkdir()  # as a disk that cannot be read
    else:
        path.write_bytes(damage(whole))
    for _ in range(2):
        rig = Rig(tmp_path)
        rig.feed(scenes.field(0, scenes.pose()))
        health = rig.mapper.health()
        assert not health.ready
        assert "onemap places reset" in health.problem
        assert str(path) in health.problem
        assert rig.newest().places_version == m.UNKNOWN_PLACES
        for procedure, request in (
            (keys.MAP_PLACES, LIST),
            (keys.MAP_CHANGE_PLACES, DRAW),
            (keys.MAP_SAVE, m.MapFile("zoned")),
            (keys.MAP_MERGE, m.MapMerge("plain")),
        ):
            assert refused(rig, procedure, request) == f"unreadable: {health.problem}"
    assert rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(all_others=True)).places == ()
    assert rig.mapper.health().ready
    assert rig.newest().places_version > 10**9  # none that a planner may know
    assert (tmp_path / f"{FORM.file_name}.unreadable").exists()
    assert rig.client.call(keys.MAP_CHANGE_PLACES, DRAW).places == (ZONE,)
    assert stays_after(rig, tmp_path).client.call(keys.MAP_PLACES, LIST).places == (ZONE,)


def test_places_whose_file_is_gone_are_missed(tmp_path: Path) -> None:
    """The checkpoint tells that there were some; also the one after a restart without them."""
    rig = Rig(tmp_path)
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)
    rig.feed(scenes.field(0, scenes.pose()))
    rig.mapper.close()
    (tmp_path / FORM.file_name).unlink()
    for k in range(2):
        rig = Rig(tmp_path)
        rig.feed(scenes.field(k + 1, scenes.pose()))
        assert "No such file" in refused(rig, keys.MAP_PLACES, LIST)
        rig.mapper.close()
    rig = Rig(tmp_path)
    assert rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(all_others=True)).places == ()
    assert stays_after(rig, tmp_path).client.call(keys.MAP_PLACES, LIST).places == ()


@pytest.mark.parametrize("older", [False, True])
def test_places_that_are_gone_or_older_than_what_was_acknowledged_are_missed(
    tmp_path: Path, older: bool
) -> None:
    """Without any checkpoint: a second file tells their version."""
    rig, path = Rig(tmp_path), tmp_path / FORM.file_name
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)
    before = path.read_bytes()
    rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange((replace(ZONE, name="ramp"),)))
    whole = path.read_bytes()
    path.unlink()
    if older:
        path.write_bytes(before)
    why = "older than what was last kept" if older else "No such file"
    rig = Rig(tmp_path)
    assert why in refused(rig, keys.MAP_PLACES, LIST)
    assert not rig.mapper.health().ready
    path.write_bytes(whole)
    assert len(Rig(tmp_path).client.call(keys.MAP_PLACES, LIST).places) == 2
    path.with_suffix(".version").write_bytes(b"torn")  # nothing rests on it where they are read
    rig = Rig(tmp_path)
    assert len(rig.client.call(keys.MAP_PLACES, LIST).places) == 2


def test_a_loaded_map_brings_its_places_instead_of_unreadable_ones(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.feed(scenes.field(0, scenes.pose()))
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)
    rig.client.call(keys.MAP_SAVE, m.MapFile("zoned"))
    (tmp_path / FORM.file_name).write_bytes(b"nothing")
    rig = Rig(tmp_path)
    rig.client.call(keys.MAP_LOAD, m.MapFile("zoned"))
    assert rig.client.call(keys.MAP_PLACES, LIST).places == (ZONE,)
    assert (tmp_path / f"{FORM.file_name}.unreadable").read_bytes() == b"nothing"


def test_a_saved_map_with_damaged_places_is_refused_whole(tmp_path: Path) -> None:
    rig, path = Rig(tmp_path), tmp_path / "zoned.npz"
    rig.feed(scenes.field(0, scenes.pose()))
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)
    rig.client.call(keys.MAP_SAVE, m.MapFile("zoned"))
    data = path.read_bytes()
    at = data.index(b"Stairs")
    path.write_bytes(data[:at] + b"Fields" + data[at + 6 :])
    before = rig.newest()
    for procedure, request in (
        (keys.MAP_LOAD, m.MapFile("zoned")),
        (keys.MAP_MERGE, m.MapMerge("zoned")),
    ):
        assert "damaged" in refused(rig, procedure, request)
    assert rig.revisions.take(0.0) is None
    assert before.places_version == 1
    assert rig.client.call(keys.MAP_PLACES, LIST).places == (ZONE,)


@given(st.data())
def test_what_is_kept_is_read_as_it_was_written_or_not_at_all(data: st.DataObject) -> None:
    with TemporaryDirectory() as folder:
        kept = FileKept(Path(folder), FORM, lambda: None, SystemClock())
        kept.change(lambda ours: ours.changed((ZONE,)))
        path = Path(folder) / FORM.file_name
        saved = bytearray(path.read_bytes())
        at, value = data.draw(st.integers(0, len(saved) - 1)), data.draw(st.integers(0, 255))
        same = saved[at] == value
        saved[at] = value
        path.write_bytes(saved[: data.draw(st.integers(0, len(saved)))] if same else saved)
        again = FileKept(Path(folder), FORM, lambda: None, SystemClock())
        if not again.unreadable:
            assert again.value.places == (ZONE,)


def test_no_zone_counts_as_gone_whose_removal_may_not_be_on_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor as there: the robot waits until a person says which it is."""
    rig = Rig(tmp_path)
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)

    def damaged(_disk: SystemDisk, _folder: Path) -> None:
        raise OSError(5, "Input/output error")

    forget = m.PlacesChange((), ("stairs",))
    with monkeypatch.context() as patch:
        patch.setattr(SystemDisk, "sync_folder", damaged)
        assert "storage: cannot write the named places" in refused(
            rig, keys.MAP_CHANGE_PLACES, forget
        )
    assert rig.newest().places_version == m.UNKNOWN_PLACES
    assert "may be on disk or not" in refused(rig, keys.MAP_PLACES, LIST)
    nothing = m.PlacesChange(all_others=True)
    assert rig.client.call(keys.MAP_CHANGE_PLACES, nothing).places == ()


def test_no_version_of_places_comes_again_after_a_change_that_was_taken_back(
    tmp_path: Path,
) -> None:
    kept = FileKept(tmp_path, FORM, lambda: None, SystemClock())
    with suppress(ZeroDivisionError), kept.exclusive() as put:
        put(kept.value.changed((ZONE,)))
        read = kept.value
        raise ZeroDivisionError
    assert kept.value.places == ()
    kept.change(lambda ours: ours.changed((replace(ZONE, name="hole"),)))
    assert kept.value.version > read.version


def full(_path: Path) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize(
    ("procedure", "request_"),
    [
        (keys.MAP_MERGE, m.MapMerge("zoned")),
        (keys.MAP_LOAD, m.MapFile("zoned")),
        (keys.MAP_CLEAR, m.MapClear()),
        (keys.MAP_CHANGE_PLACES, m.PlacesChange((replace(ZONE, name="hole"),))),
    ],
)
def test_zones_that_cannot_be_written_refuse_the_whole_change(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    procedure: keys.Procedure[Any, Any],
    request_: Any,
) -> None:
    """Neither the map in use nor its zones change, in memory and on disk."""
    rig = Rig(tmp_path)
    rig.feed(scenes.field(0, scenes.pose()))
    rig.client.call(keys.MAP_CHANGE_PLACES, DRAW)
    rig.client.call(keys.MAP_SAVE, m.MapFile("zoned"))
    rig.feed(scenes.field(1, scenes.pose()))
    other = m.PlacesChange((replace(ZONE, name="ramp"),), ("stairs",))
    rig.client.call(keys.MAP_CHANGE_PLACES, other)
    rig.newest()
    with monkeypatch.context() as patch:
        patch.setattr("onemap_mapper.storage.kept.replacing", full)
        assert "storage: cannot write the named places" in refused(rig, procedure, request_)
    assert rig.revisions.take(0.0) is None
    assert rig.metric("frames_fused") == 2
    for each in (rig, Rig(tmp_path)):
        assert [p.name for p in each.client.call(keys.MAP_PLACES, LIST).places] == ["ramp"]
