"""The map of a real gateway, saved, loaded, described and cleared."""

from __future__ import annotations

import io

import numpy as np
import pytest

from onemap import Client, InvalidSetting, OneMapError
from tests.gateway.fakes import FakeMapper


def test_a_map_is_saved_and_loaded_by_its_name(client: Client, mapper: FakeMapper) -> None:
    saved = client.maps.save("flat")
    assert (saved.path, saved.cells_observed, saved.frames_fused) == ("maps/flat", 315, 7)
    assert client.maps.load("flat") == saved
    assert client.maps.clear().path == ""
    assert mapper.saved == ["flat"]


def test_a_map_that_is_not_there_is_an_error(client: Client, mapper: FakeMapper) -> None:
    with pytest.raises(OneMapError, match="'house'") as error:
        client.maps.load("house")
    assert error.value.status == 404
    with pytest.raises(OneMapError, match="begins with a letter") as error:
        client.maps.save("-flat")
    assert error.value.status == 422


@pytest.mark.parametrize("name", ["", "../etc", "..", "a/b"])
def test_a_name_that_would_be_another_address_is_not_sent(client: Client, name: str) -> None:
    with pytest.raises(InvalidSetting, match="begins with a letter"):
        client.maps.delete(name)


def test_saved_maps_are_listed_and_deleted(client: Client, mapper: FakeMapper) -> None:
    client.maps.save("flat")
    client.maps.save("house")
    newest, oldest = client.maps.list()
    assert (newest.name, oldest.name) == ("house", "flat")
    assert client.maps.get("house") == newest
    assert newest.saved_at.tzinfo is not None
    assert newest.saved_at.timestamp() == pytest.approx(newest.saved_ns / 1e9)
    assert client.maps.delete("house") == newest
    assert [stored.name for stored in client.maps.list()] == ["flat"]


def test_the_map_in_numbers(client: Client, mapper: FakeMapper) -> None:
    info = client.maps.info()
    assert info.bounds_m == pytest.approx((-1.0, -0.5, 3.0, 2.5))
    assert info.free_m2 == pytest.approx(3.0)
    assert info.occupied_m2 == pytest.approx(0.15)
    assert (info.revision, info.rate_hz) == (7, 0.0)


def test_the_archive_is_what_numpy_loads(client: Client, mapper: FakeMapper) -> None:
    with np.load(io.BytesIO(client.maps.archive())) as archive:
        assert archive["occupancy"].shape == (40, 30)


def test_a_saved_map_is_merged(client: Client, mapper: FakeMapper) -> None:
    client.maps.save("flat")
    assert client.maps.merge("flat", x_m=1.5, yaw_rad=0.5).cells_observed == 315
    (merged,) = mapper.merged
    assert (merged.x_m, merged.y_m, merged.yaw_rad) == (1.5, 0.0, 0.5)


def test_an_archive_holds_the_similarity_that_is_asked_for(
    client: Client, mapper: FakeMapper
) -> None:
    assert client.maps.archive("sofa") != client.maps.archive()
    with pytest.raises(OneMapError, match="flurb"):
        client.maps.archive("flurb")
