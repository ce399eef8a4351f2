"""The mapper on the in-memory bus, with a simulated perception."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np
import pytest

from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import FrameUpdate, compute_update
from onemap_mapper.service import Mapper, build
from onemap_planner.world.map_view import with_changes
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.transport import RemoteError, RequestRejected
from tests.mapper import scenes
from tests.mapper.finds import object_find
from tests.memory_bus import MemoryBus, MemoryRouter
from tests.shared.samples import PNG

SOFA = np.eye(16, dtype=np.float32)[3]
ZONE = m.Place("Stairs", m.PlaceKind.KEEP_OUT, corners_m=((0.0, 0.0), (2.0, 0.0), (2.0, 1.0)))
WORDS = {"desk": np.eye(16, dtype=np.float32)[1], "cup": np.eye(16, dtype=np.float32)[2]}
NEUTRAL = np.eye(16, dtype=np.float32)[[5, 6]]


class Rig:
    """A mapper and, around it, what perception and a planner would say and ask."""

    def __init__(self, folder: Path, **settings: Any) -> None:
        self.router = MemoryRouter()
        config = MapperConfig(map_folder=folder, **settings)
        self.mapper: Mapper = build(self.router.bus("mapper"), config)
        self.client: MemoryBus = self.router.bus("planner")
        self.revisions = self.client.subscribe(keys.MAP_REVISION, capacity=100)
        self.fields = self.client.publish(keys.FIELD)
        self.asked: list[str] = []
        self.images: list[bytes] = []
        self.floor = 0.0
        self.perception: MemoryBus | None = None

    def embed(self, text_space: str = "space-a", channels: int = 16) -> None:
        """Let perception answer for texts."""

        def answer(request: m.TextRequest) -> m.TextEmbeddings:
            self.asked += request.texts
            if "flurb" in request.texts:
                raise ValueError("flurb is not a word I know")
            if "flub" in request.texts:
                raise RequestRejected("unknown_word", "flub is not a word I know")
            return m.TextEmbeddings(
                "encoder-a",
                text_space,
                request.texts,
                np.stack([WORDS.get(text, SOFA)[:channels] for text in request.texts]),
                NEUTRAL[:, :channels],
                np.ones((len(request.texts), 2), np.uint8),
                30.0,
                self.floor,
            )

        def seen(request: m.ImageRequest) -> m.TextEmbeddings:
            self.images.append(request.image)
            return answer(m.TextRequest(("image",)))

        self.perception = self.router.bus("perception")
        self.perception.serve(keys.EMBED_TEXT, answer)
        self.perception.serve(keys.EMBED_IMAGE, seen)

    def feed(self, *fields: m.FeatureField) -> None:
        for field in fields:
            self.fields.put(field)
            self.mapper.step(0.0)

    def newest(self) -> m.MapRevision:
        found = None
        while (revision := self.revisions.take(0.0)) is not None:
            found = revision
        assert found is not None
        return found

    def metric(self, name: str) -> float:
        metrics = self.mapper.health().metrics
        assert metrics is not None
        return metrics[name]


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    made = Rig(tmp_path / "maps")
    made.embed()
    return made


def sofa_ahead(sequence: int, x_m: float = 0.0) -> m.FeatureField:
    """A frame in which the middle of the image looks like a sofa."""
    features = np.tile(NEUTRAL[0], (6, 8, 1))
    features[2:4, 3:5] = SOFA
    return scenes.field(sequence, scenes.pose(x_m), features=features)


def refusal(ask: Callable[[], object]) -> RemoteError:
    with pytest.raises(RemoteError) as caught:
        ask()
    return caught.value


def test_a_frame_becomes_a_revision_and_has_a_receipt(rig: Rig) -> None:
    receipts = rig.client.subscribe(keys.FIELD_RECEIPTS)
    rig.feed(sofa_ahead(0))
    assert receipts.take(0.0) == m.FrameReceipt(0, sofa_ahead(0).stamp_ns)
    revision = rig.newest()
    assert (revision.revision, revision.sequence, revision.frames_fused) == (1, 0, 1)
    assert revision.stamp_ns == sofa_ahead(0).stamp_ns
    assert (revision.encoder_id, revision.text_space) == ("encoder-a", "space-a")
    assert revision.cells_observed == rig.metric("cells") > 0
    assert revision.memory_bytes == rig.metric("memory_bytes") > 0
    late = rig.router.bus("gateway").subscribe(keys.MAP_REVISION)
    assert late.take(0.0) == revision  # latched


def test_the_sofa_is_where_it_was_seen(rig: Rig) -> None:
    rig.feed(*(sofa_ahead(k) for k in range(3)))
    reply = rig.client.call(keys.MAP_SIMILARITY, m.SimilarityRequest(" sofa ", include_grid=True))
    assert reply.best_score == pytest.approx(float(reply.scores[0]))
    assert reply.best_score > 0.9
    assert (reply.revision, reply.encoder_id) == (rig.newest().revision, "encoder-a")
    x, y = reply.centres_m[0]
    assert 1.5 < x < 3.2  # ahead, where the middle of the image meets floor and wall
    assert abs(y) < 0.5
    x_min, y_min, x_max, y_max = reply.extents_m[0]
    assert x_min < x < x_max
    assert y_min < y < y_max
    assert (reply.variances > 0).all()
    assert reply.scores_grid.shape == reply.grid.shape
    view = rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest("sofa"))
    np.testing.assert_array_equal(view.similarity, reply.scores_grid)
    assert rig.asked.count("sofa") == 1


def test_what_it_must_not_be_competes_in_a_query_and_on_the_planners_map_alike(rig: Rig) -> None:
    rig.feed(sofa_ahead(0))
    plain = rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest("sofa"))
    query = m.SimilarityRequest("sofa", include_grid=True, negatives=("couch",))
    reply = rig.client.call(keys.MAP_SIMILARITY, query)
    asked = m.SearchViewRequest("sofa", negatives=("couch",))
    view = rig.client.call(keys.MAP_SEARCH_VIEW, asked)
    np.testing.assert_array_equal(view.similarity, reply.scores_grid)
    assert np.nanmax(plain.similarity - view.similarity) > 0.01
    first = view_changes(rig, "sofa")
    request = m.ViewChangesRequest("sofa", ("desk",), first.key, ("couch",))
    changes = rig.client.call(keys.MAP_VIEW_CHANGES, request)
    assert changes.base == m.NO_VIEW  # another question: what is known of the first says nothing
    found = with_changes(None, changes).whole()
    np.testing.assert_array_equal(found.similarity, view.similarity)


def view_changes(rig: Rig, text: str = "", have: m.ViewKey = m.NO_VIEW) -> m.ViewChanges:
    request = m.ViewChangesRequest(text, ("desk",) if text else (), have)
    return rig.client.call(keys.MAP_VIEW_CHANGES, request)


def test_a_known_view_is_replied_as_what_changed(rig: Rig) -> None:
    rig.feed(sofa_ahead(0))
    first = view_changes(rig, "sofa")
    assert first.base == m.NO_VIEW
    still = view_changes(rig, "sofa", first.key)
    assert (still.base, len(still.layers)) == (first.key, 0)
    rig.feed(sofa_ahead(1, 0.1))
    second = view_changes(rig, "sofa", first.key)
    assert second.base == first.key
    view = with_changes(with_changes(None, first), second).whole()
    whole = rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest("sofa", ("desk",)))
    assert (view.revision, view.stamp_ns) == (whole.revision, sofa_ahead(1).stamp_ns)
    for name in ("occupancy", "layers", "similarity", "rival", "guidance"):
        np.testing.assert_array_equal(getattr(view, name), getattr(whole, name))


def test_a_view_of_another_map_or_text_is_replied_whole(rig: Rig) -> None:
    empty = view_changes(rig, "sofa")
    assert (empty.base, empty.grid.shape) == (m.NO_VIEW, (0, 0))
    rig.feed(sofa_ahead(0))
    sofa = view_changes(rig, "sofa", empty.key)
    assert sofa.base == m.NO_VIEW  # its cells have scores now
    assert view_changes(rig, "cup", sofa.key).base == m.NO_VIEW
    assert view_changes(rig, "", sofa.key).base == m.NO_VIEW
    for query in ("", "1.x", "9" * 400):
        assert view_changes(rig, "sofa", replace(sofa.key, query=query)).base == m.NO_VIEW
    assert view_changes(rig, "sofa", replace(sofa.key, number=10**6)).base == m.NO_VIEW
    rig.client.call(keys.MAP_SEARCH_RESET, m.SearchReset("search-1"))
    reset = view_changes(rig, "sofa", sofa.key)
    assert reset.base == m.NO_VIEW  # the searched layer of all cells
    rig.client.call(keys.MAP_CLEAR, m.MapClear())
    rig.feed(sofa_ahead(1))
    assert view_changes(rig, "sofa", reset.key).base == m.NO_VIEW


def test_an_empty_map_rejects_queries(rig: Rig) -> None:
    error = refusal(lambda: rig.client.call(keys.MAP_SIMILARITY, m.SimilarityRequest("sofa")))
    assert error.code == "empty_map"
    view = rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest("sofa"))
    assert (view.text, view.grid.shape, view.stamp_ns) == ("sofa", (0, 0), 0)
    assert refusal(lambda: rig.client.call(keys.MAP_SAVE, m.MapFile("a"))).code == "empty_map"
    assert rig.asked == []


def test_a_field_of_another_encoder_is_refused(rig: Rig) -> None:
    rig.feed(sofa_ahead(0), scenes.field(1, scenes.pose(), encoder_id="encoder-b"))
    assert rig.metric("frames_refused") == 1
    assert rig.metric("frames_fused") == 1
    health = rig.mapper.health()
    assert "encoder-b" in health.problem
    assert not health.ready
    rig.feed(sofa_ahead(2))
    assert rig.mapper.health().ready


def test_late_frames_are_ignored_but_a_clock_set_back_is_followed(rig: Rig) -> None:
    newest, late = sofa_ahead(50), sofa_ahead(49)
    rig.feed(newest, late)
    assert rig.metric("frames_late") == 1
    assert rig.newest().sequence == 50
    rig.feed(replace(sofa_ahead(51), stamp_ns=newest.stamp_ns - 60 * 10**9))
    assert rig.newest().sequence == 51


def test_texts_of_another_space_are_refused(rig: Rig) -> None:
    rig.feed(sofa_ahead(0))
    assert rig.perception is not None
    rig.perception.close()
    rig.embed(text_space="space-b")
    error = refusal(lambda: rig.client.call(keys.MAP_SIMILARITY, m.SimilarityRequest("sofa")))
    assert error.code == "encoder_mismatch"
    assert "space-b" in str(error)
    rig.perception.close()
    rig.embed(channels=8)
    error = refusal(lambda: rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest("sofa")))
    assert error.code == "encoder_mismatch"
    rig.perception.close()
    rig.embed()  # the wrong answer was not kept
    assert rig.client.call(keys.MAP_SIMILARITY, m.SimilarityRequest("sofa")).scores[0] > 0.9


def test_save_clear_and_load_bring_the_map_back(rig: Rig, tmp_path: Path) -> None:
    rig.feed(*(sofa_ahead(k) for k in range(3)))
    before = rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest("sofa"))
    saved = rig.client.call(keys.MAP_SAVE, m.MapFile("flat-1"))
    assert Path(saved.path) == tmp_path / "maps" / "flat-1.npz"
    assert saved.file_bytes == Path(saved.path).stat().st_size
    assert saved.created
    cleared = rig.client.call(keys.MAP_CLEAR, m.MapClear())
    assert (cleared.cells_observed, cleared.frames_fused) == (0, 0)
    loaded = rig.client.call(keys.MAP_LOAD, m.MapFile("flat-1"))
    assert loaded == replace(saved, created=False)
    assert not rig.client.call(keys.MAP_SAVE, m.MapFile("flat-1")).created
    after = rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest("sofa"))
    assert after.revision > before.revision
    for name in ("occupancy", "layers", "similarity"):
        np.testing.assert_array_equal(getattr(before, name), getattr(after, name))


@pytest.mark.parametrize("loads", [False, True])
def test_a_frame_of_before_is_not_fused_into_another_map(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, loads: bool
) -> None:
    """The map is cleared, or another one loaded, while a frame is computed."""
    rig.feed(sofa_ahead(0))
    rig.client.call(keys.MAP_SAVE, m.MapFile("flat-1"))

    def interrupted(*arguments: Any, **options: Any) -> FrameUpdate:
        if loads:
            rig.client.call(keys.MAP_LOAD, m.MapFile("flat-1"))
        else:
            rig.client.call(keys.MAP_CLEAR, m.MapClear())
        return compute_update(*arguments, **options)

    with monkeypatch.context() as patched:
        patched.setattr(rig.mapper, "_compute", interrupted)
        rig.feed(sofa_ahead(1))
    assert rig.newest().frames_fused == int(loads)
    rig.feed(sofa_ahead(2))
    assert rig.newest().frames_fused == int(loads) + 1


def test_a_refused_load_changes_nothing(rig: Rig, tmp_path: Path) -> None:
    rig.feed(sofa_ahead(0))
    before = rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest())
    (tmp_path / "maps").mkdir(exist_ok=True)
    (tmp_path / "maps" / "broken.npz").write_bytes(b"PK\x03\x04 no map")
    codes = {"broken": "invalid", "missing": "unknown_map", "../escape": "invalid"}
    for name, code in codes.items():
        with pytest.raises(RemoteError, match=name.strip("./")) as refused:
            rig.client.call(keys.MAP_LOAD, m.MapFile(name))
        assert refused.value.code == code
    after = rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest())
    assert after.revision == before.revision
    np.testing.assert_array_equal(after.occupancy, before.occupancy)


def test_a_folder_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    rig = Rig(tmp_path / "maps")
    rig.feed(sofa_ahead(0))
    rmtree(tmp_path / "maps")
    (tmp_path / "maps").write_text("a file, not a folder")
    error = refusal(lambda: rig.client.call(keys.MAP_SAVE, m.MapFile("a")))
    assert error.code == "storage"


def test_found_objects_go_with_the_map(rig: Rig, tmp_path: Path) -> None:
    def names() -> list[str]:
        listed = rig.client.call(keys.MAP_OBJECTS, m.ObjectListRequest())
        return [kept.name for kept in listed.objects]

    rig.feed(sofa_ahead(0))
    before = rig.newest()
    rig.client.call(keys.MAP_REMEMBER, object_find("bed"))
    after = rig.newest()  # announced at once, without a new frame
    assert (after.revision, after.frames_fused) == (before.revision, before.frames_fused)
    assert after.objects_version > before.objects_version
    rig.client.call(keys.MAP_SAVE, m.MapFile("flat"))
    rig.client.call(keys.MAP_REMEMBER, object_find("sofa"))
    rig.client.call(keys.MAP_LOAD, m.MapFile("flat"))
    assert names() == ["bed"]
    loaded = rig.newest()
    assert loaded.objects_version > after.objects_version + 1
    rig.client.call(keys.MAP_CLEAR, m.MapClear())
    assert names() == []
    assert rig.newest().objects_version > loaded.objects_version
    listed = Rig(tmp_path / "maps").client.call(keys.MAP_LIST, m.MapListRequest())
    assert listed.maps[0].name == "flat"


def test_a_pose_bomb_is_refused_and_the_next_frame_is_fused(rig: Rig) -> None:
    bomb = scenes.pose(90_000.0, 0.0)
    rig.feed(replace(sofa_ahead(0), T_map_camera=bomb))
    assert "further than max_extent_m" in rig.mapper.health().problem
    assert rig.metric("cells") == 0
    rig.feed(sofa_ahead(1))
    cells = rig.metric("cells")
    assert cells > 0
    rig.feed(replace(sofa_ahead(2), T_map_camera=bomb))
    assert "did the pose jump" in rig.mapper.health().problem
    rig.feed(sofa_ahead(3))
    assert rig.metric("cells") == cells
    assert rig.metric("frames_refused") == 2


def restarted(folder: Path, **settings: Any) -> Rig:
    """A mapper of another process on the same folder."""
    again = Rig(folder, **settings)
    again.embed()
    return again


def test_a_restarted_mapper_resumes_the_map(rig: Rig, tmp_path: Path) -> None:
    rig.feed(*(sofa_ahead(k) for k in range(3)))
    before = rig.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest("sofa"))
    rig.mapper.close()
    again = restarted(tmp_path / "maps")
    after = again.client.call(keys.MAP_SEARCH_VIEW, m.SearchViewRequest("sofa"))
    np.testing.assert_array_equal(after.occupancy, before.occupancy)
    np.testing.assert_array_equal(after.layers, before.layers)
    np.testing.assert_allclose(after.similarity, before.similarity, atol=1e-6)
    late = again.router.bus("late").subscribe(keys.MAP_REVISION).take(0.0)
    assert late is not None
    assert late.frames_fused == 3
    again.feed(sofa_ahead(3))
    assert again.metric("frames_fused") == 4


def test_a_resumed_map_of_another_encoder_is_dropped(rig: Rig, tmp_path: Path) -> None:
    rig.feed(sofa_ahead(0))
    rig.mapper.close()
    again = restarted(tmp_path / "maps")
    others = [scenes.field(k, scenes.pose(), encoder_id="encoder-b") for k in range(1, 4)]
    again.feed(*others[:2])
    assert again.metric("frames_fused") == 1  # a damaged header drops no map
    again.feed(others[2])
    revision = again.newest()
    assert (revision.encoder_id, revision.frames_fused) == ("encoder-b", 1)
    assert "it is dropped, and a new one begins" in again.mapper.health().problem
    again.feed(sofa_ahead(4))  # once frames were fused, encoders are never mixed
    assert "encoder-b" in again.mapper.health().problem


@pytest.mark.parametrize("now", ["flat", "office"])
@pytest.mark.parametrize("mapper", ["runs", "resumes", "begins anew"])
def test_what_is_of_another_world_is_set_aside(
    rig: Rig, tmp_path: Path, now: str, mapper: str
) -> None:
    folder, before = tmp_path / "maps", "flat"
    rig.feed(*(replace(sofa_ahead(k), world=before) for k in range(2)))
    rig.client.call(keys.MAP_REMEMBER, object_find())
    rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange((ZONE,)))
    again = rig
    if mapper != "runs":
        rig.mapper.close()
        again = restarted(folder, resume=mapper == "resumes")
    again.feed(*(replace(sofa_ahead(k), world=now) for k in range(2, 7)))
    same = before == now and mapper != "begins anew"
    aside = folder / "other_worlds" / "1"
    if same:
        assert again.metric("frames_fused") == 7
    else:
        assert again.metric("frames_fused") <= 5
    found = again.client.call(keys.MAP_OBJECTS, m.ObjectListRequest()).objects
    assert len(found) == same
    named = again.client.call(keys.MAP_PLACES, m.PlacesRequest()).places
    assert (ZONE in named) is same
    assert aside.exists() is not same
    if not same:
        assert (aside / "objects.bin").exists()
        assert (aside / "places.bin").exists()
        assert list(aside.glob("*.npz"))
        why = "driver was started anew" if before == now else f"another world (/{before})"
        assert why in again.mapper.health().problem
    again.mapper.close()
    assert restarted(folder).metric("frames_fused") == again.metric("frames_fused")


def world_in(folder: Path) -> str:
    return (folder / "world.txt").read_text().splitlines()[1]


def driven(rig: Rig, instance: str) -> MemoryBus:
    """A driver of the robot on the rig's bus."""
    bus = rig.router.bus("simulator")
    bus.instance = instance
    bus.claim()
    return bus


@pytest.mark.parametrize(
    ("settings", "world"),
    [({"resume": False}, "flat"), ({}, "frame odom"), ({}, "frame r1/odom_combined")],
)
@pytest.mark.parametrize("driver", ["first", "second"])
def test_a_map_whose_frame_begins_anew_goes_with_its_driver(
    tmp_path: Path, settings: dict[str, Any], world: str, driver: str
) -> None:
    """A mapper that alone is restarted goes on with map, zones and objects; no other one does."""

    def kept(rig: Rig) -> tuple[bool, bool, float]:
        places = rig.client.call(keys.MAP_PLACES, m.PlacesRequest()).places
        objects = rig.client.call(keys.MAP_OBJECTS, m.ObjectListRequest()).objects
        return ZONE in places, bool(objects), rig.metric("frames_fused")

    rig = Rig(tmp_path, **settings)
    driven(rig, "first")
    rig.feed(*(replace(sofa_ahead(k), world=world) for k in range(2)))
    rig.client.call(keys.MAP_REMEMBER, object_find())
    rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange((ZONE,)))
    rig.mapper.close()
    again = Rig(tmp_path, **settings)
    bus, same = driven(again, driver), driver == "first"
    assert again.metric("frames_fused") == 0  # not known yet
    again.feed(*(replace(sofa_ahead(k), world=world) for k in range(2, 4)))
    assert kept(again) == ((True, True, 4) if same else (False, False, 2))
    assert (tmp_path / "other_worlds").exists() is not same
    bus.close()
    again.feed(replace(sofa_ahead(4), world=world))  # it may only have lost the router
    assert kept(again)[0] is same
    driven(again, "third")
    again.feed(*(replace(sofa_ahead(k), world=world) for k in range(5, 7)))
    assert kept(again) == (False, False, 2)


def test_frames_wait_until_what_is_of_another_world_is_set_aside(rig: Rig, tmp_path: Path) -> None:
    rig.feed(replace(sofa_ahead(0), world="flat"))
    rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange((ZONE,)))
    (tmp_path / "maps" / "other_worlds").write_text("in the way")
    rig.feed(*(replace(sofa_ahead(k), world="office") for k in range(1, 4)))
    assert "cannot set aside" in rig.mapper.health().problem
    assert not rig.mapper.health().ready
    assert ZONE in rig.client.call(keys.MAP_PLACES, m.PlacesRequest()).places
    (tmp_path / "maps" / "other_worlds").unlink()
    rig.feed(*(replace(sofa_ahead(k), world="office") for k in (4, 5)))
    assert ZONE not in rig.client.call(keys.MAP_PLACES, m.PlacesRequest()).places


def test_a_map_of_an_earlier_release_is_of_the_world_of_the_next_frame(
    rig: Rig, tmp_path: Path
) -> None:
    rig.feed(sofa_ahead(0))
    rig.mapper.close()
    (tmp_path / "maps" / "world.txt").unlink()
    again = restarted(tmp_path / "maps")
    again.feed(replace(sofa_ahead(1), world="flat"))
    assert again.metric("frames_fused") == 2
    assert world_in(tmp_path / "maps") == "/flat"


def test_a_loaded_map_is_of_the_world_of_the_next_frame(rig: Rig, tmp_path: Path) -> None:
    rig.feed(replace(sofa_ahead(0), world="flat"))
    rig.client.call(keys.MAP_SAVE, m.MapFile("a"))
    again = restarted(tmp_path / "other")
    (tmp_path / "other").mkdir()
    (tmp_path / "maps" / "a.npz").rename(tmp_path / "other" / "a.npz")
    again.client.call(keys.MAP_LOAD, m.MapFile("a"))
    again.feed(replace(sofa_ahead(1), world="office"))
    assert again.metric("frames_fused") == 2
    assert not (tmp_path / "other" / "other_worlds").exists()


@pytest.mark.parametrize("loaded", [False, True])
def test_a_damaged_header_never_changes_the_world(rig: Rig, tmp_path: Path, loaded: bool) -> None:
    """Zones and map stay, and the frames after it are fused."""
    folder = tmp_path / "maps"
    rig.feed(replace(sofa_ahead(0), world="flat"))
    rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange((ZONE,)))
    if loaded:
        rig.client.call(keys.MAP_SAVE, m.MapFile("a"))
        rig.client.call(keys.MAP_LOAD, m.MapFile("a"))
    names = ("fl@t", "flat", "flat", "flat", "vlat", "fl!t", "flat")
    rig.feed(*(replace(sofa_ahead(k + 1), world=name) for k, name in enumerate(names)))
    assert ZONE in rig.client.call(keys.MAP_PLACES, m.PlacesRequest()).places
    assert not (folder / "other_worlds").exists()
    assert rig.metric("frames_fused") >= 3
    assert rig.mapper.health().problem == ""
    assert world_in(folder) == "/flat"


@pytest.mark.parametrize("nbytes", [0, 8, 20])
def test_a_torn_world_sets_no_zones_aside(rig: Rig, tmp_path: Path, nbytes: int) -> None:
    folder = tmp_path / "maps"
    rig.feed(replace(sofa_ahead(0), world="flat"))
    rig.client.call(keys.MAP_CHANGE_PLACES, m.PlacesChange((ZONE,)))
    rig.mapper.close()
    torn = (folder / "world.txt").read_bytes()[:nbytes]
    (folder / "world.txt").write_bytes(torn)
    again = restarted(folder)
    again.feed(*(replace(sofa_ahead(k), world="flat") for k in range(1, 5)))
    assert ZONE in again.client.call(keys.MAP_PLACES, m.PlacesRequest()).places
    assert not (folder / "other_worlds").exists()
    assert world_in(folder) == "/flat"


def test_a_cleared_map_is_not_resumed(rig: Rig, tmp_path: Path) -> None:
    rig.feed(sofa_ahead(0))
    rig.mapper.close()
    again = restarted(tmp_path / "maps")
    again.client.call(keys.MAP_CLEAR, m.MapClear())
    again.mapper.close()
    assert restarted(tmp_path / "maps").metric("cells") == 0


def test_saving_beyond_the_quota_is_refused(rig: Rig, tmp_path: Path) -> None:
    rig.feed(sofa_ahead(0))
    (tmp_path / "maps").mkdir(exist_ok=True)
    with (tmp_path / "maps" / "large.npz").open("wb") as file:
        file.truncate(10**10)
    error = refusal(lambda: rig.client.call(keys.MAP_SAVE, m.MapFile("a")))
    assert error.code == "storage"
    assert "map_quota_mb" in str(error)
    rig.client.call(keys.MAP_DELETE, m.MapFile("large"))
    assert rig.client.call(keys.MAP_SAVE, m.MapFile("a")).created


IMAGE = m.ImageSimilarityRequest(PNG, m.SimilarityRequest("the image"))


def test_what_a_picture_shows_is_where_it_was_seen(rig: Rig) -> None:
    rig.feed(*(sofa_ahead(k) for k in range(3)))
    reply = rig.client.call(keys.MAP_IMAGE_SIMILARITY, IMAGE)
    text = rig.client.call(keys.MAP_SIMILARITY, m.SimilarityRequest("sofa"))
    np.testing.assert_array_equal(reply.centres_m, text.centres_m)
    np.testing.assert_array_equal(reply.scores, text.scores)
    assert (reply.text, reply.verdict) == ("the image", text.verdict)
    assert (reply.calibrated, text.calibrated) == (False, True)
    rig.client.call(keys.MAP_IMAGE_SIMILARITY, IMAGE)
    assert rig.images == [PNG]  # embedded once
