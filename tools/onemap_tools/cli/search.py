"""``onemap search`` and ``onemap query``: ask a running robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

from onemap_shared.messages import FINAL_STATES, SearchState
from onemap_tools.cli.progress import SearchProgress, progress_view
from onemap_tools.client import GatewayClient
from onemap_tools.demo.run_monitor import RunMonitor
from onemap_tools.errors import CliError
from onemap_tools.processes.interrupts import interruptible

POLL_S = 0.5
PATIENCE = 20  # polls in a row that may fail: a killed gateway is back by then


@dataclass(frozen=True, slots=True)
class MapRate:
    """Seconds since the map last changed, and updates per second; None: not told."""

    map_age_s: float | None = None
    map_rate_hz: float | None = None


def map_rate(gateway: GatewayClient) -> MapRate:
    """What the gateway has cached of the map; nothing if it does not say. No call to the mapper."""
    try:
        streams = gateway.status()["streams"]
    except (CliError, KeyError):
        return MapRate()
    told = [stream for stream in streams if stream["name"] == "revision"]
    return MapRate(told[0]["age_s"], told[0]["rate_hz"]) if told else MapRate()


def progress_of(
    search: dict[str, Any], monitor: RunMonitor | None = None, map_rate: MapRate | None = None
) -> SearchProgress:
    """A search as the gateway reports it, with what a witness on the bus knows besides, or with
    the ``map_rate`` of the map where there is none."""
    told = monitor or map_rate
    return SearchProgress(
        elapsed_s=search["elapsed_s"],
        objects=tuple(search["objects"]),
        done=tuple((result["name"], result["outcome"]) for result in search["results"]),
        target=search["target"],
        state=search["state"],
        reason=search["reason"],
        path_length_m=search["path_length_m"],
        position_m=monitor.position_m if monitor else None,
        map_age_s=told.map_age_s if told else None,
        map_rate_hz=told.map_rate_hz if told else None,
    )


class SearchHandle:
    """A search that is asked about again and again; a gateway may be away for a while."""

    def __init__(self, gateway: GatewayClient, report: dict[str, Any]) -> None:
        self._gateway = gateway
        self._failures = 0
        self.report = report

    @property
    def active(self) -> bool:
        """Whether the robot is still at it, as far as is known."""
        return self.report["state"] not in FINAL_STATES

    def poll(self) -> str:
        """Ask once; returns why there was no answer, empty if there was one."""
        try:
            self.report = self._gateway.search(self.report["id"])
        except CliError as trouble:
            self._failures += 1
            if self._failures > PATIENCE:
                raise
            return str(trouble)
        self._failures = 0
        return ""

    def cancel(self) -> None:
        """Stop the search."""
        self.report = self._gateway.cancel(self.report["id"])


def search(gateway: GatewayClient, objects: tuple[str, ...], console: Console) -> dict[str, Any]:
    """Find the objects one after the other; Ctrl-C cancels. Returns the final report."""
    with interruptible() as stop, progress_view(console) as view:
        handle = SearchHandle(gateway, gateway.start_search(objects))
        while handle.active:
            view.show(progress_of(handle.report, map_rate=map_rate(gateway)))
            if stop.wait(POLL_S):
                handle.cancel()
                break
            if problem := handle.poll():
                view.wait(handle.report["elapsed_s"], problem)
    return handle.report


def all_found(report: dict[str, Any]) -> bool:
    """Whether every object of the search was found."""
    found = [r["name"] for r in report["results"] if r["outcome"] == SearchState.FOUND.value]
    return len(found) == len(report["objects"])


def describe_search(report: dict[str, Any], console: Console) -> None:
    """Print how the search ended."""
    table = Table("object", "outcome", "position", "time", "path", "reason")
    for result in report["results"]:
        place = ", ".join(f"{value:.2f}" for value in result["position_m"] or ())
        table.add_row(
            result["name"],
            result["outcome"].replace("_", " "),
            f"({place}) m" if place else "",
            f"{result['duration_s']:.0f} s",
            f"{result['path_length_m']:.1f} m",
            result["reason"],
        )
    console.print(table)
    if not all_found(report):
        console.print(report["reason"])


def describe_query(reply: dict[str, Any], console: Console) -> None:
    """Print where on the map it may be."""
    if not reply["regions"]:
        console.print(reply["message"])
        return
    table = Table("", "centre", "size", "score", title=reply["text"])
    for region in reply["regions"]:
        x_min, y_min, x_max, y_max = region["extent_m"]
        table.add_row(
            str(region["rank"]),
            f"({region['centre_m'][0]:.2f}, {region['centre_m'][1]:.2f}) m",
            f"{x_max - x_min:.1f} x {y_max - y_min:.1f} m",
            f"{region['score']:.2f}",
        )
    console.print(table)
    if near := reply.get("did_you_mean"):  # older gateways do not tell
        console.print(
            f"The encoder does not know {reply['text']!r}; did you mean "
            f"{' or '.join(repr(word) for word in near)}?"
        )
