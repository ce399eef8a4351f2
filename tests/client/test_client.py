"""What the client asks of a real gateway, and how little its import needs."""

from __future__ import annotations

import subprocess
import sys

import httpx
import pytest

from onemap import DEFAULT_URL, Client, OneMapError
from onemap_tools.processes.network import DEFAULT_URL as URL_OF_COMMANDS
from onemap_tools.processes.network import any_free_port
from tests.gateway.fakes import FakeMapper, FakePlanner

HEAVY = ("numpy", "zenoh", "torch", "pydantic", "onemap_shared")


def test_the_import_is_light() -> None:
    code = f"import sys, onemap; print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_commands_and_client_look_at_the_same_address() -> None:
    assert DEFAULT_URL == URL_OF_COMMANDS


def test_a_query_has_regions_best_first(client: Client, mapper: FakeMapper) -> None:
    result = client.query("sofa")
    best, second = result.regions
    assert best.rank == 1
    assert best.centre_m == pytest.approx((0.35, 1.15))
    assert best.variance == pytest.approx(0.1)
    assert best.extent_m == pytest.approx((0.2, 1.0, 0.5, 1.3))
    assert second.variance is None
    assert result.best_score == pytest.approx(0.9)
    assert result.message == ""
    assert len(client.query("sofa", max_regions=1).regions) == 1


def test_a_query_without_regions_has_a_message(client: Client, mapper: FakeMapper) -> None:
    result = client.query("kite")
    assert result.regions == ()
    assert result.message.startswith("Nothing on the map looks like 'kite'")
    assert result.did_you_mean == ("ball", "fan")


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


def test_the_status_names_services_and_streams(client: Client) -> None:
    status = client.status()
    assert not status.ready
    assert status.problem
    assert "mapper" in {service.name for service in status.services}
    assert "revision" in {stream.name for stream in status.streams}
    assert all(stream.age_s is None for stream in status.streams)
    assert status.document["ready"] is False


def test_the_missing_stage_is_that_of_readyz(client: Client) -> None:
    assert "robot" in client.missing_stage().lower()
    assert "gateway" in Client(f"http://127.0.0.1:{any_free_port()}").missing_stage()
    ready = httpx.MockTransport(lambda _: httpx.Response(200, json={"status": "ok"}))
    assert Client(transport=ready).missing_stage() == ""
