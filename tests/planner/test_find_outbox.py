"""Finds reach the mapper once it is there, and are dropped with their map."""

from __future__ import annotations

import logging

import pytest

from onemap_planner.planning_thread import MAX_UNSENT, FindOutbox
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import KeptObject, ObjectFind
from onemap_shared.transport import RequestRejected
from tests.shared.samples import SAMPLES

KEPT = next(sample for sample in SAMPLES if isinstance(sample, KeptObject))


def find(name: str) -> ObjectFind:
    return ObjectFind(name, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), 0.9, 1, "s1")


class Mapper:
    """Takes finds, as long as nothing is in ``refusal``: code and text."""

    def __init__(self, router: MemoryRouter) -> None:
        self.kept: list[str] = []
        self.refusal: tuple[str, str] | None = None
        self.bus = router.bus("mapper")
        self.bus.serve(keys.MAP_REMEMBER, self._remember)

    def _remember(self, request: ObjectFind) -> KeptObject:
        if self.refusal is not None:
            raise RequestRejected(*self.refusal)
        self.kept.append(request.name)
        return KEPT


def test_finds_wait_for_the_mapper_and_are_sent_once() -> None:
    router = MemoryRouter()
    outbox = FindOutbox(router.bus("planner"))
    outbox.add([find("bed"), find("sofa")])
    outbox.send()
    mapper = Mapper(router)
    outbox.send()
    outbox.send()
    assert mapper.kept == ["bed", "sofa"]


def test_finds_of_another_map_are_dropped() -> None:
    router = MemoryRouter()
    outbox = FindOutbox(router.bus("planner"))
    outbox.add([find("bed")])
    outbox.clear()
    mapper = Mapper(router)
    outbox.send()
    assert mapper.kept == []


def test_the_list_is_bounded() -> None:
    router = MemoryRouter()
    outbox = FindOutbox(router.bus("planner"))
    outbox.add(find(f"thing {n}") for n in range(MAX_UNSENT + 2))
    mapper = Mapper(router)
    outbox.send()
    assert mapper.kept == [f"thing {n}" for n in range(2, MAX_UNSENT + 2)]


@pytest.mark.parametrize(("code", "after"), [("invalid", ["sofa"]), ("internal", ["bed", "sofa"])])
def test_a_refusal_is_logged_once_and_final_if_the_find_is_invalid(
    code: str, after: list[str], caplog: pytest.LogCaptureFixture
) -> None:
    router = MemoryRouter()
    outbox = FindOutbox(router.bus("planner"))
    mapper = Mapper(router)
    mapper.refusal = (code, "no room")
    outbox.add([find("bed")])
    with caplog.at_level(logging.ERROR, "onemap.planner"):
        outbox.send()
        outbox.send()
    assert [record.getMessage() for record in caplog.records] == [
        "the map does not keep bed: no room"
    ]
    mapper.refusal = None
    outbox.add([find("sofa")])
    outbox.send()
    assert mapper.kept == after
