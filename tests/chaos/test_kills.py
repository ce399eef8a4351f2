"""Every service is killed once during one search; the search goes on and finds its objects."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

from onemap_shared import keys
from onemap_shared.messages import SearchState, TruthRequest
from tests.chaos.report import Attack
from tests.end_to_end.system import START_S, System

pytestmark = pytest.mark.timeout(700)

KILLED = ("perception", "mapper", "planner", "gateway", "router")
SOUGHT = ("bed", "television", "refrigerator", "sofa", "toilet")
RECOVERED_S = 60.0  # on two busy cores; perception loads its model in 5 s on idle ones
FOUND_S = 480.0


def present_objects(system: System) -> list[str]:
    """Those of ``SOUGHT`` that the scene has."""
    truth = system.monitor.bus.call(keys.ROBOT_TRUTH, TruthRequest(SOUGHT[0], 0.0, 0.0), 5.0)
    return [name for name in SOUGHT if name in truth.categories]


def seconds_until(system: System, true: Callable[[], object], limit_s: float) -> float:
    """How long a condition took to come true; the limit if it did not."""
    began_s = time.monotonic()
    try:
        system.until(true, "", limit_s)
    except AssertionError:
        return limit_s
    return time.monotonic() - began_s


def instance(system: System, service: str) -> str:
    """The instance of a service that was heard last; the router has none."""
    beat = system.monitor.beats.get(service)
    return beat.instance if beat is not None else ""


def seconds_to_recover(system: System, service: str, over: Callable[[], bool]) -> float:
    """From the kill of a service until a new one is heard, all is ready and the robot moves."""
    before = instance(system, service)
    system.kill(service)
    system.start(service)

    def recovered() -> bool:
        back = service == "router" or instance(system, service) != before
        return back and system.is_ready() and (system.monitor.moves or over())

    return seconds_until(system, recovered, RECOVERED_S)


def test_every_service_is_killed_during_one_search(system: System, attack: Attack) -> None:
    objects = present_objects(system)
    search = system.http.post("/v1/searches", json={"objects": objects}).json()

    def over() -> bool:
        status = system.monitor.search
        same = status is not None and status.search_id == search["id"]
        return same and status is not None and len(status.results) == len(objects)

    for service in KILLED:
        system.until(lambda: system.monitor.moves or over(), "the robot moves", START_S)
        took_s = seconds_to_recover(system, service, over)
        attack.holds(
            f"{service} is killed and started during a search",
            limit=f"it is back and the robot moves within {RECOVERED_S:g} s",
            measured=f"{took_s:.1f} s",
            held=took_s < RECOVERED_S,
        )
    took_s = seconds_until(system, over, FOUND_S)
    status = system.monitor.search
    results = status.results if status is not None else ()
    found = sum(result.outcome is SearchState.FOUND for result in results)
    attack.holds(
        "the search during which each was killed",
        limit=f"all {len(objects)} objects found within {FOUND_S:g} s more",
        measured=f"{found} found, {took_s:.0f} s",
        held=found == len(objects),
    )
