"""What the client asks of a real gateway, and how little its import needs."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import httpx
import pytest

from onemap import (
    DEFAULT_URL,
    Client,
    InvalidSetting,
    MapPose,
    OneMapError,
    QueryOptions,
)
from onemap_tools.processes.network import DEFAULT_URL as URL_OF_COMMANDS
from onemap_tools.processes.network import any_free_port
from tests.gateway.fakes import PICTURE, STAMP_NS, FakeMapper, FakePlanner, kept_object
from tests.shared.samples import PNG

HEAVY = ("numpy", "zenoh", "torch", "fastapi", "onemap_shared")


def test_the_import_is_light() -> None:
    code = f"import sys, onemap; print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_commands_and_client_look_at_the_same_address() -> None:
    assert DEFAULT_URL == URL_OF_COMMANDS


def test_an_unknown_word_has_hints(client: Client, planner: FakePlanner) -> None:
    with pytest.raises(OneMapError, match="did you mean 'curb'") as error:
        client.search("flurb")
    assert (error.value.status, error.value.type) == (422, "/docs#problem-unknown_word")
    assert error.value.title == "The encoder does not know this word"
    assert error.value.hints == {"flurb": ("curb",)}
    assert not error.value.temporary


def test_without_a_mapper_the_error_is_temporary(client: Client) -> None:
    with pytest.raises(OneMapError, match="mapper is not running") as error:
        client.query("sofa")
    assert (error.value.status, error.value.temporary, error.value.hints) == (503, True, {})
    assert error.value.document["service"] == "mapper"


def test_the_missing_stage_is_that_of_readyz(client: Client) -> None:
    assert "robot" in client.missing_stage().lower()
    assert "gateway" in Client(f"http://127.0.0.1:{any_free_port()}").missing_stage()
    ready = httpx.MockTransport(lambda _: httpx.Response(200, json={"status": "ok"}))
    assert Client(transport=ready).missing_stage() == ""


def test_a_query_has_a_verdict_and_where_it_was_seen(client: Client, mapper: FakeMapper) -> None:
    kite, sofa = client.query_all(["kite", "sofa"], QueryOptions(max_regions=1))
    assert (kite.text, kite.verdict, kite.regions) == ("kite", "not_looked_yet", ())
    assert kite.message.startswith("Nothing on the map looks like 'kite'")
    assert sofa.found
    assert sofa == client.query("sofa", 1).model_copy(update={"age_s": sofa.age_s})
    assert (sofa.looked.share, sofa.looked.frontier_m) == (0.75, (1.5, 0.5))
    (best,) = sofa.regions
    assert best.best_view == MapPose(x_m=1.0, y_m=2.0, yaw_rad=0.5)
    with pytest.raises(OneMapError, match="flurb"):
        client.query_all(["sofa", "flurb"])


def test_a_sentence_or_its_parts_are_asked_for(
    client: Client, mapper: FakeMapper, planner: FakePlanner
) -> None:
    near = client.query("sofa near the bed", 2)
    on = client.query({"text": "sofa", "on": "bed"}, 3)
    assert near.understood == "sofa, within 1 m of a bed, anywhere"
    assert on.understood == "sofa, on a bed, anywhere"
    assert [each.max_regions for each in mapper.asked] == [2, 3]
    search = client.search(["kettle", {"text": "sofa", "colour": "red"}])
    assert search.latest.understood == "kettle, anywhere; red sofa, anywhere"
    assert [each.colour for each in planner.requests[-1].details] == ["", "red"]


def test_an_image_is_asked_for(client: Client, mapper: FakeMapper) -> None:
    result = client.query_image(PNG, QueryOptions(max_regions=1, area_m=(0, -1, 2, 3)))
    assert mapper.images == [PNG]
    assert mapper.asked[0].area_m == (0.0, -1.0, 2.0, 3.0)
    assert (result.text, result.calibrated, len(result.regions)) == ("image", False, 1)
    assert client.query("sofa").calibrated
    with pytest.raises(OneMapError, match="no PNG and no JPEG"):
        client.query_image(b"GIF89a")


def test_objects_are_listed_shown_and_forgotten(client: Client, mapper: FakeMapper) -> None:
    blind = replace(kept_object("00ff00ff", "sofa"), box_px=(), picture_bytes=0, height_m=())
    mapper.objects += [kept_object(), blind]
    bed, sofa = client.objects()
    assert (bed.id, bed.name, bed.position_m) == ("3f9a12c4", "bed", (3.42, -1.15, 0.41))
    assert (bed.extent_m, bed.box_px) == ((2.5, -2.1, 4.4, -0.3), (4.0, 6.0, 20.0, 18.0))
    assert (bed.height_m, sofa.height_m) == ((0.1, 0.7), None)
    assert (bed.score, bed.times_found, bed.search_id) == (0.93, 2, "s1")
    assert (bed.first_found_ns, bed.last_seen_ns) == (STAMP_NS, STAMP_NS + 10**9)
    assert bed.last_seen_at.isoformat() == "2026-01-01T00:00:01+00:00"
    assert (bed.has_picture, sofa.has_picture, sofa.box_px) == (True, False, None)
    assert client.object_picture(bed.id) == PICTURE
    assert client.forget_object(bed.id) == bed
    assert client.objects() == [sofa]


def test_maps_are_saved_listed_loaded_merged_and_deleted(
    client: Client, mapper: FakeMapper
) -> None:
    saved = client.maps.save("flat")
    assert (saved.path, saved.cells_observed, saved.frames_fused) == ("maps/flat", 315, 7)
    client.maps.save("house")
    newest, oldest = client.maps.list()
    assert (newest.name, oldest.name) == ("house", "flat")
    assert client.maps.get("house") == newest
    assert newest.saved_at.timestamp() == pytest.approx(newest.saved_ns / 1e9)
    assert client.maps.load("flat") == saved
    assert client.maps.merge("flat", x_m=1.5, yaw_rad=0.5).cells_observed == 315
    (merged,) = mapper.merged
    assert (merged.x_m, merged.y_m, merged.yaw_rad) == (1.5, 0.0, 0.5)
    assert client.maps.delete("house") == newest
    assert [stored.name for stored in client.maps.list()] == ["flat"]
    assert client.maps.clear().path == ""
    assert {place.room for place in client.places().places} == {0, 3}
    with pytest.raises(OneMapError, match="'house'") as error:
        client.maps.load("house")
    assert error.value.status == 404
    with pytest.raises(OneMapError, match="begins with a letter"):
        client.maps.save("-flat")


@pytest.mark.parametrize("name", ["", "../etc", "..", "a/b"])
def test_a_name_that_would_be_another_address_is_not_sent(client: Client, name: str) -> None:
    for ask in (client.maps.delete, client.object_picture):
        with pytest.raises(InvalidSetting, match="begins with a letter or a digit and has no"):
            ask(name)
