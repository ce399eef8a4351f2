"""The map survives its mapper: killed, or stopped, it comes back with what was seen."""

from __future__ import annotations

from pathlib import Path

import pytest

from onemap_mapper.storage import map_file
from onemap_mapper.storage.checkpoints import newest
from onemap_shared.messages import MapRevision
from tests.end_to_end.conftest import SIMULATOR
from tests.end_to_end.system import START_S, System

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

MAPPING = ("simulator", "perception", "mapper")


def kept(system: System) -> tuple[int, int]:
    """Cells and frames of the newest checkpoint."""
    content, problems = newest(system.folder / "maps")
    assert not problems
    return (0, 0) if content is None else (len(content.cells), content.header.frames_fused)


def announced(system: System) -> MapRevision:
    """The next revision of the map."""
    before = system.monitor.revision
    system.until(lambda: system.monitor.revision is not before, "a map is announced", START_S)
    assert system.monitor.revision is not None
    return system.monitor.revision


def apartment(folder: Path, seed: int) -> System:
    """A robot that stands and looks, and a mapper that writes a checkpoint every 15 s."""
    return System(folder, (*MAPPING, "gateway"), {"simulator": {**SIMULATOR, "seed": seed}})


def test_a_map_is_resumed_in_its_world_and_set_aside_in_another(tmp_path: Path) -> None:
    with apartment(tmp_path, 1) as mapping:
        mapping.until(lambda: kept(mapping)[1] > 10, "a checkpoint is written", 2 * START_S)
        for end, code in (("kill", -9), ("terminate", 0)):
            last = announced(mapping)
            getattr(mapping.processes["mapper"], end)()
            assert mapping.processes["mapper"].wait() == code
            cells, frames = kept(mapping)
            assert cells > 100
            if end == "terminate":  # written once more at the end
                assert frames >= last.frames_fused
            mapping.monitor.revision = None
            mapping.start("mapper")
            first = announced(mapping)
            assert first.frames_fused >= frames  # a map that began anew has one
            assert first.cells_observed >= cells
            assert announced(mapping).frames_fused > frames  # and frames reach it
    before = kept(mapping)[1]
    aside = tmp_path / "maps" / "other_worlds" / "1"
    with apartment(tmp_path, 2) as system:
        system.until(aside.exists, "the map is set aside", 2 * START_S)
        assert announced(system).frames_fused < before
        said = "map was of another world"  # the status capitalises it
        system.until(lambda: said in system.http.get("/v1/status").text, "the status says so")
        assert said in system.log("mapper").read_text()
    assert "apartment" in (aside / "world.txt").read_text()
    assert map_file.read(max(aside.glob("*.npz"))).header.frames_fused == before
