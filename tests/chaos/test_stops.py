"""How soon the robot stands, and how far it comes, when something fails while it drives."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise
from math import hypot

import pytest

from onemap_shared.messages import Odometry
from tests.chaos.report import Attack
from tests.end_to_end.system import MOVING_MPS, START_S, System, absent_object

pytestmark = pytest.mark.timeout(900)

FAST_MPS = 0.4  # of 0.7: what happens to a robot that creeps says little
# Until the last command has run out, 0.3 s, and the simulated robot has braked at 1 m/s^2.
LAST_COMMAND = (1100.0, 50.0)


def drives(system: System) -> None:
    """A search drives the robot, fast and straight."""
    system.restore()
    current = system.http.get("/v1/searches/current")
    if current.status_code == 404 or not current.json()["active"]:
        asked = system.http.post("/v1/searches", json={"object": absent_object(system)})
        assert asked.status_code == 201, asked.text

    def fast() -> bool:
        newest = list(system.monitor.odometry)[-1:]
        return any(each.linear_mps > FAST_MPS for each in newest)

    system.until(fast, "the robot drives fast", START_S)


def speed(message: Odometry) -> float:
    return max(abs(message.linear_mps), abs(message.angular_radps))


def stands(heard: list[Odometry], at_ns: int) -> bool:
    return any(each.stamp_ns >= at_ns and speed(each) < MOVING_MPS for each in heard)


def stop_of(system: System, cause: Callable[[], object]) -> tuple[float, float, float]:
    """Milliseconds and centimetres from a cause until the robot stands; m/s before it."""
    before = system.monitor.odometry[-1]
    heard = system.monitor.recorded = []
    at_ns = time.time_ns()
    cause()
    system.until(lambda: stands(list(heard), at_ns), "the robot stands", START_S)
    system.monitor.recorded = None
    after = [each for each in heard if each.stamp_ns >= at_ns]
    end = next(i for i, each in enumerate(after) if speed(each) < MOVING_MPS)
    way = [before, *after[: end + 1]]
    steps = [b.T_map_body[:2, 3] - a.T_map_body[:2, 3] for a, b in pairwise(way)]
    way_cm = 100 * sum(hypot(*step) for step in steps)
    return (after[end].stamp_ns - at_ns) / 1e6, way_cm, before.linear_mps


def cancelled(system: System) -> None:
    assert system.http.delete("/v1/searches/current").status_code == 200


def router_away(system: System) -> None:
    """Odometry comes when it is back: the way counts, the time does not.

    Without its planner, which would drive on before the first odometry is heard here.
    """
    system.kill("router")
    system.kill("planner")
    system.start("router")


CAUSES: dict[str, tuple[Callable[[System], object], tuple[float, float]]] = {
    "the search is cancelled": (cancelled, (900.0, 40.0)),
    "the planner is killed": (lambda system: system.kill("planner"), LAST_COMMAND),
    "the planner is frozen": (lambda system: system.suspend("planner"), LAST_COMMAND),
    "the router is killed": (router_away, (float("inf"), 50.0)),
    "the mapper is frozen": (lambda system: system.suspend("mapper"), (2500.0, 150.0)),
    "perception is frozen": (lambda system: system.suspend("perception"), (2500.0, 150.0)),
}


@pytest.mark.parametrize("what", CAUSES)
def test_the_robot_stands_soon(system: System, attack: Attack, what: str) -> None:
    cause, (limit_ms, limit_cm) = CAUSES[what]
    drives(system)
    ms, cm, mps = stop_of(system, lambda: cause(system))
    known = f"{ms:.0f} ms, " if limit_ms < float("inf") else ""
    attack.holds(
        f"{what} at {mps:.2f} m/s",
        limit=f"it stands within {limit_ms:.0f} ms and {limit_cm:.0f} cm",
        measured=f"{known}{cm:.0f} cm",
        held=ms <= limit_ms and cm <= limit_cm,
    )
