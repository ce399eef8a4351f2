"""``onemap map``: save, load, describe, export and clear the map of a running robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from onemap_tools.client import GatewayClient
from onemap_tools.errors import CliError


def describe_change(done: str) -> Callable[[dict[str, Any], Console], None]:
    """Prints what the map holds after it was saved, loaded or cleared."""

    def describe(change: dict[str, Any], console: Console) -> None:
        what = f"{done} {change['path']}".rstrip()
        held = f"{change['cells_observed']} cells from {change['frames_fused']} frames"
        size = f", {change['file_bytes'] / 1e6:.1f} MB" if change["file_bytes"] else ""
        console.print(Text(f"{what}: {held}{size}."), soft_wrap=True)

    return describe


def describe_info(info: dict[str, Any], console: Console) -> None:
    """Print the map in numbers."""
    x_min, y_min, x_max, y_max = info["bounds_m"]
    age = "empty" if info["age_s"] is None else f"{info['age_s']:.1f} s"
    table = Table.grid(padding=(0, 2))
    for name, value in (
        ("revision", str(info["revision"])),
        ("newest frame", age),
        ("extent", f"{x_max - x_min:.1f} x {y_max - y_min:.1f} m"),
        ("observed", f"{info['observed_m2']:.1f} m2"),
        ("free", f"{info['free_m2']:.1f} m2"),
        ("occupied", f"{info['occupied_m2']:.1f} m2"),
        ("memory", f"{info['memory_bytes'] / 1e6:.1f} MB"),
        ("updates", f"{info['rate_hz']:.1f} Hz, {info['update_ms']:.0f} ms each"),
        ("encoder", f"{info['encoder_id']} ({info['text_space']})"),
    ):
        table.add_row(name, Text(value))
    console.print(table)


def write_archive(gateway: GatewayClient, file: Path) -> dict[str, Any]:
    """Write occupancy, layers and geometry of the map to an ``.npz`` file."""
    content = gateway.map_archive()
    try:
        file.write_bytes(content)
    except OSError as problem:
        raise CliError(f"Cannot write {file}: {problem.strerror}.") from problem
    return {"path": str(file), "file_bytes": len(content)}


def describe_export(written: dict[str, Any], console: Console) -> None:
    """Print where the archive lies."""
    console.print(Text(f"Wrote {written['path']}, {written['file_bytes']} bytes."), soft_wrap=True)
