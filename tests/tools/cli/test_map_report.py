"""What is said of a map, and the archive that is written."""

from __future__ import annotations

import io
from pathlib import Path

import httpx
import pytest
from rich.console import Console

from onemap_tools.cli.map_report import (
    describe_change,
    describe_export,
    describe_info,
    write_archive,
)
from onemap_tools.cli.status import describe_status
from onemap_tools.client import GatewayClient
from onemap_tools.errors import CliError

CHANGE = {
    "path": "/maps/flat.npz",
    "cells_observed": 81,
    "frames_fused": 9,
    "file_bytes": 2_500_000,
}
INFO = {
    "revision": 412,
    "age_s": None,
    "bounds_m": [0.0, -1.0, 4.0, 5.0],
    "observed_m2": 20.0,
    "free_m2": 12.0,
    "occupied_m2": 6.5,
    "memory_bytes": 3_100_000,
    "rate_hz": 7.9,
    "update_ms": 21.0,
    "encoder_id": "mini-1",
    "text_space": "minilm",
}
STATUS = {
    "ready": False,
    "problem": "The mapper is not running.",
    "services": [{"name": "mapper", "condition": "down", "problem": "It is [not] running."}],
    "streams": [
        {
            "name": "rgbd",
            "age_s": None,
            "rate_hz": 0.0,
            "received": 0,
            "missed": 0,
            "refused": 0,
        }
    ],
}


@pytest.fixture
def console() -> Console:
    return Console(file=io.StringIO(), width=200)


def text_of(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_saved_map_is_told_with_path_and_size(console: Console) -> None:
    describe_change("Saved")(CHANGE, console)
    assert text_of(console) == "Saved /maps/flat.npz: 81 cells from 9 frames, 2.5 MB.\n"


def test_a_cleared_map_has_neither(console: Console) -> None:
    empty = {"path": "", "cells_observed": 0, "frames_fused": 0, "file_bytes": 0}
    describe_change("Cleared")(empty, console)
    assert text_of(console) == "Cleared: 0 cells from 0 frames.\n"


def test_the_map_in_numbers(console: Console) -> None:
    describe_info(INFO, console)
    for part in ("412", "empty", "4.0 x 6.0 m", "20.0 m2", "3.1 MB", "mini-1 (minilm)"):
        assert part in text_of(console)


def test_the_archive_is_written_as_it_came(tmp_path: Path, console: Console) -> None:
    gateway = GatewayClient(
        transport=httpx.MockTransport(lambda _: httpx.Response(200, content=b"npz"))
    )
    written = write_archive(gateway, tmp_path / "map.npz")
    assert (tmp_path / "map.npz").read_bytes() == b"npz"
    describe_export(written, console)
    assert "3 bytes" in text_of(console)
    with pytest.raises(CliError, match="Cannot write"):
        write_archive(gateway, tmp_path / "no" / "such" / "folder.npz")


def test_status_names_what_is_missing(console: Console) -> None:
    describe_status(STATUS, console)
    for part in ("mapper", "down", "It is [not] running.", "never", "Not ready. The mapper"):
        assert part in text_of(console)
