"""Houses that a whole module of tests lives in: starting one takes seconds."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.end_to_end.system import START_S, House

ROBOT_AND_ALL = ("simulator", "perception", "mapper", "planner", "gateway")
SIMULATOR = {"seed": 1, "rgbd_hz": 6.0}


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[House]:
    """Every service and a simulated robot, ready."""
    folder = tmp_path_factory.mktemp("house")
    with House(folder, ROBOT_AND_ALL, {"simulator": SIMULATOR}) as house:
        house.until(house.is_ready, "frames go all the way to the map", START_S)
        yield house
