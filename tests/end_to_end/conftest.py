"""A running system for a whole module of tests: starting one takes seconds."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from onemap_tools.processes.services import CORE
from tests.end_to_end.system import START_S, System

SIMULATED = ("simulator", *CORE)
SIMULATOR = {"seed": 1, "rgbd_hz": 4.0}


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Every service and a simulated robot, ready."""
    folder = tmp_path_factory.mktemp("system")
    with System(folder, SIMULATED, {"simulator": SIMULATOR}) as system:
        system.until(system.is_ready, "frames go all the way to the map", START_S)
        yield system
