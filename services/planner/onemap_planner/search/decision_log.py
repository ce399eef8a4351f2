"""Journal of the decisions of each search on disk, for ``onemap search replay``.

One file of JSON lines per search. A line has the members of ``GET /v1/searches/{id}``, so that it
is read as a reply of the gateway is; it is written at once and as a whole.
"""
# Touches files: the decisions of searches.

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime, timezone
from pathlib import Path
from typing import IO, Any

from onemap_shared.messages import SearchStatus

SCHEMA = 1
FOLDER = "decisions"
MAX_FILES = 50  # the newest are kept, as many as searches are remembered
MAX_FILE_BYTES = 2_000_000  # about 1500 decisions; then only the end is recorded


def record(folder: Path, status: SearchStatus, robot_xy: tuple[float, float] | None) -> None:
    """Append a step of a search to its file; raises OSError.

    robot_xy: metres in the map frame, None without odometry.
    """
    path = folder / FOLDER / file_name(status)
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_oldest(path.parent, MAX_FILES - 1)
    line = json.dumps(step_document(status, robot_xy), allow_nan=False).encode() + b"\n"
    with path.open("a+b", buffering=0) as file:
        file.truncate(_complete_bytes(file))
        if status.active and file.seek(0, os.SEEK_END) + len(line) > MAX_FILE_BYTES:
            return
        file.write(line)


def file_name(status: SearchStatus) -> str:
    """The name of the file of a search; names sort by the time when the search began."""
    began = datetime.fromtimestamp(status.started_ns / 1e9, tz=timezone.utc)
    return f"{began:%Y%m%dT%H%M%SZ}-{status.search_id}.jsonl"


def step_document(status: SearchStatus, robot_xy: tuple[float, float] | None) -> Mapping[str, Any]:
    """The line of a step, as a dict."""
    values = asdict(status)
    choice = values.pop("choice")
    return {
        "schema": SCHEMA,
        "id": values.pop("search_id"),
        "robot_xy_m": robot_xy,
        "elapsed_s": max(status.updated_ns - status.started_ns, 0) / 1e9,
        "target": status.target,
        **values,
        "choice": choice if choice["options"] else None,
    }


def _complete_bytes(file: IO[bytes]) -> int:
    """The length of a file without a last line that was cut off, as by a loss of power."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(size - 1, 0))
    if file.read(1) in (b"", b"\n"):
        return size
    file.seek(0)
    return file.read().rfind(b"\n") + 1


def _remove_oldest(folder: Path, keep: int) -> None:
    names = sorted(folder.glob("*.jsonl"))
    for path in names[: max(len(names) - keep, 0)]:
        path.unlink(missing_ok=True)
