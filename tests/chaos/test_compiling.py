"""The mapper ends during a search and must compile its kernels again before it is back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.chaos.report import Attack
from tests.end_to_end.conftest import SIMULATED, SIMULATOR
from tests.end_to_end.system import START_S, System
from tests.end_to_end.test_restart import searching

pytestmark = pytest.mark.timeout(900)

SECTIONS: dict[str, Any] = {"simulator": SIMULATOR}
PLACES = ("/v1/searches/current", "/v1/status")


def test_a_search_waits_for_a_mapper_that_compiles(tmp_path: Path, attack: Attack) -> None:
    with System(tmp_path, SIMULATED, SECTIONS) as system:
        search = searching(system)
        system.kill("mapper")
        system.environment["NUMBA_CACHE_DIR"] = str(tmp_path / "cache")  # compiled anew, 45 s
        system.start("mapper")
        said: set[str] = set()

        def compiles() -> bool:
            texts = {path: system.http.get(path).text for path in PLACES}
            said.update(path for path in PLACES if "ompiling the map's kernels" in texts[path])
            return len(said) == len(PLACES)

        system.until(compiles, "search and status say that it compiles")
        system.monitor.odometry.clear()
        system.until(lambda: system.monitor.moves, "the robot drives on", START_S)
        now = system.http.get(PLACES[0]).json()
        attack.holds(
            "the mapper is killed and compiles for 45 s, with a patience of 20 s",
            limit="search and status say so, and the same search goes on",
            measured=f"{', '.join(sorted(said))}; {now['state']}",
            held=(now["id"], now["active"]) == (search["id"], True),
        )
