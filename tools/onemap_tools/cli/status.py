"""``onemap status``: what runs, and how."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

COLOURS = {"ok": "green", "degraded": "yellow", "down": "red"}


def describe_status(status: dict[str, Any], console: Console) -> None:
    """Print services and streams as the gateway sees them."""
    services = Table("service", "condition", "what is wrong")
    for service in status["services"]:
        condition = Text(service["condition"], style=COLOURS.get(service["condition"], ""))
        services.add_row(service["name"], condition, Text(service["problem"]))
    streams = Table("stream", "age", "rate", "received", "missed", "refused")
    for stream in status["streams"]:
        age_s = stream["age_s"]
        streams.add_row(
            stream["name"],
            "never" if age_s is None else f"{age_s:.1f} s",
            f"{stream['rate_hz']:.1f} Hz",
            str(stream["received"]),
            str(stream["missed"]),
            str(stream["refused"]),
        )
    console.print(services, streams)
    console.print(Text("Ready." if status["ready"] else f"Not ready. {status['problem']}"))
