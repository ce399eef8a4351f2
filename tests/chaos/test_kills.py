"""Services are killed and suspended during a search; the others report it and go on.

The map outlives its mapper, whether that is killed or stopped.
"""

from __future__ import annotations

from typing import Any

import pytest

from onemap_mapper.storage.checkpoints import newest
from tests.end_to_end.system import PATIENCE_S, START_S, System, absent_object

pytestmark = pytest.mark.timeout(900)


def searching(system: System) -> str:
    """The id of an active search in which the robot moves."""
    system.restore()
    current = system.http.get("/v1/searches/current")
    if current.status_code == 404 or not current.json()["active"]:
        current = system.http.post("/v1/searches", json={"objects": [absent_object(system)]})
        assert current.status_code == 201, current.text
    system.until(lambda: system.monitor.moves, "the robot moves")
    search_id: str = current.json()["id"]
    return search_id


def goes_on(system: System, search_id: str) -> None:
    """The same search is active again, and the robot moves."""
    system.monitor.odometry.clear()
    system.until(system.is_ready, "the system is ready again", START_S)
    system.until(lambda: system.monitor.moves, "the robot moves again", START_S)
    search = system.http.get("/v1/searches/current").json()
    assert search["id"] == search_id
    assert search["active"]


def others_live(system: System, gone: str) -> None:
    """All other services are connected and make progress."""
    others = set(system.services) - {gone}
    before = {name: system.monitor.beats[name].progress for name in others}
    system.until(
        lambda: all(system.monitor.beats[name].progress > before[name] for name in others),
        f"the others' loops advance without {gone}",
    )
    assert system.monitor.alive >= others


def down(system: System) -> set[str]:
    services = system.http.get("/v1/status").json()["services"]
    return {service["name"] for service in services if service["condition"] == "down"}


def refused(system: System, path: str, body: dict[str, Any]) -> dict[str, Any]:
    """The problem document of a request that cannot be served now."""
    answer = system.http.post(path, json=body)
    assert answer.status_code == 503, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    document: dict[str, Any] = answer.json()
    return document


REQUESTS = {  # requests that need the service, with a word that no cache holds
    "perception": ("/v1/queries", {"text": "toaster"}),
    "mapper": ("/v1/queries", {"text": "kettle"}),
    "planner": ("/v1/searches", {"object": "kettle"}),
}


def frames_kept(system: System) -> int:
    """Frames in the newest checkpoint of the map; 0 if there is none."""
    content, problems = newest(system.folder / "maps")
    assert not problems
    return 0 if content is None else content.header.frames_fused


@pytest.mark.parametrize("service", REQUESTS)
def test_a_killed_service_is_named_and_the_others_go_on(system: System, service: str) -> None:
    search_id = searching(system)
    system.until(lambda: frames_kept(system) > 10, "a checkpoint is written")
    system.kill(service)
    frames = frames_kept(system)
    system.until(lambda: system.monitor.stands, "the robot brakes")
    system.until(lambda: system.lacks(service), f"/readyz names {service}")
    assert service in down(system)
    problem = refused(system, *REQUESTS[service])
    assert problem["service"] == service
    assert service in problem["detail"].lower()
    others_live(system, service)
    before = system.monitor.revision
    system.start(service)
    system.until(lambda: system.monitor.revision is not before, "a map is announced", START_S)
    assert system.monitor.revision is not None
    assert system.monitor.revision.frames_fused >= frames  # a map that began anew has one
    if service != "planner":  # whose end is that of its search
        goes_on(system, search_id)


def test_the_robot_needs_no_gateway(system: System) -> None:
    search_id = searching(system)
    system.kill("gateway")
    others_live(system, "gateway")
    system.monitor.odometry.clear()
    system.until(lambda: system.monitor.moves, "the robot moves on")
    system.start("gateway")
    goes_on(system, search_id)


def problem_of(system: System, service: str) -> str:
    """The problem of a service in /v1/status."""
    services = system.http.get("/v1/status").json()["services"]
    problem: str = next(each["problem"] for each in services if each["name"] == service)
    return problem


def test_a_hanging_service_is_to_be_restarted_and_an_ended_one_started(system: System) -> None:
    service = "mapper"
    system.restore()
    # After a killed router the gateway must receive a heartbeat again before it can miss one.
    system.until(lambda: problem_of(system, service) == "", "it has no problem")
    system.suspend(service)
    system.until(lambda: "process hangs" in problem_of(system, service), "it is missed")
    system.until(lambda: system.lacks(service), f"/readyz names {service}")
    refusal = refused(system, *REQUESTS[service])
    assert (refusal["type"], refusal["service"]) == ("/docs#problem-timeout", service)
    answer = system.ready()
    assert answer is not None
    doctor = system.onemap("doctor")
    assert doctor.returncode == 1
    status = system.onemap("status", "--url", str(system.http.base_url))
    for sentence in (problem_of(system, service), refusal["detail"], answer.json()["detail"]):
        assert sentence.startswith(f"The {service} has not been heard from for ")
        assert sentence.endswith("restart it rather than start a second one.")
    for output in (doctor.stdout, status.stdout):
        words = " ".join(output.split())
        assert "process hangs or its link" in words
        assert f"The {service} is not running" not in words
        assert f"onemap service {service}" not in words
    system.kill(service)
    system.start(service)
    system.until(system.is_ready, "the system is ready again", START_S)
    assert system.onemap("status", "--service", service).returncode == 0  # as containers ask
    last = system.monitor.revision
    assert last is not None
    system.processes[service].terminate()
    system.until(
        lambda: f"start it with 'onemap service {service}'" in problem_of(system, service),
        "it ended",
    )
    assert system.processes[service].wait(PATIENCE_S) == 0
    assert frames_kept(system) >= last.frames_fused  # the map was written once more
    down = system.onemap("status", "--service", service)
    assert down.returncode == 1
    assert service in down.stdout + down.stderr
