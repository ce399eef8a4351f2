"""Houses that a whole module of tests lives in: starting one takes seconds."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.end_to_end.system import START_S, System

ROBOT_AND_ALL = ("simulator", "perception", "mapper", "planner", "gateway")
SIMULATOR = {"seed": 1, "rgbd_hz": 6.0}


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Every service and a simulated robot, ready."""
    folder = tmp_path_factory.mktemp("system")
    with System(folder, ROBOT_AND_ALL, {"simulator": SIMULATOR}) as system:
        system.until(system.is_ready, "frames go all the way to the map", START_S)
        yield system
