"""A demo of a recording: mapped as it is played, then asked; nothing moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from onemap import Client
from onemap.replies import QueryResult

IN_FLIGHT = 3  # frames between replay and map, at most


def play(
    gateway: Client, objects: Sequence[str], pause: Callable[[], None], overdue: Callable[[], bool]
) -> dict[str, Any]:
    """Wait until each frame was played once from now on, and ask; as JSON can hold it.

    Ends early, not ``worked``, when it is ``overdue``. OneMapError at once for words that the
    encoder does not know.
    """
    if objects:
        gateway.query_all(objects)
    while not (numbers := _metrics(gateway, "replay")):
        pause()
    recorded, began = int(numbers["frames_recorded"]), _played(numbers)
    while (played := _played(_metrics(gateway, "replay")) - began) < recorded and not overdue():
        pause()
    fused = gateway.maps.info().frames_fused
    while gateway.maps.info().frames_fused < fused + IN_FLIGHT and not overdue():
        pause()
    numbers, floor = _metrics(gateway, "replay") or numbers, _metrics(gateway, "mapper")
    trouble = f"Only {played} of {recorded} frames were played within the time limit."
    return {
        "worked": played >= recorded,
        "frames": recorded,
        "frames_skipped": int(numbers["frames_skipped"]),
        "frames_unreadable": int(numbers["frames_unreadable"]),
        "frames_lost": int(numbers.get("frames_lost", 0)),
        "frames_fused": gateway.maps.info().frames_fused,
        "floor_height_m": floor.get("floor_height_m"),
        "answers": [_answer(each) for each in gateway.query_all(objects)] if objects else [],
        "trouble": "" if played >= recorded else trouble,
    }


def _metrics(gateway: Client, service: str) -> Mapping[str, Any]:
    """What the newest heartbeat of a service says; empty without one."""
    services = gateway.status().services
    return next((each.metrics for each in services if each.name == service), {})


def _played(metrics: Mapping[str, Any]) -> int:
    return int(metrics.get("frames_played", 0) + metrics.get("frames_unreadable", 0))


def _answer(result: QueryResult) -> dict[str, Any]:
    best = result.regions[0] if result.regions else None
    return {
        "object": result.text,
        "verdict": result.verdict,
        "sentence": result.sentence or result.message,
        "position_m": list(best.centre_m) if best else None,
        "score": best.score if best else None,
    }


def lines(document: Mapping[str, Any]) -> list[str]:
    """The document for people."""
    told = [
        f"{document['frames_fused']} frames fused, {document['frames']} in the recording; "
        f"{document['frames_skipped']} left out, {document['frames_unreadable']} not readable, "
        f"{document['frames_lost']} lost on the way."
    ]
    if document["frames_lost"]:
        told.append("A lower ONEMAP__REPLAY__RATE_HZ loses fewer.")
    if document["floor_height_m"] is not None:
        told.append(f"The floor appears at z = {document['floor_height_m']:+.2f} m.")
    for answer in document["answers"]:
        place = answer["position_m"]
        where = f" Best at ({place[0]:.1f}, {place[1]:.1f})." if place else ""
        told.append(f"{answer['object']}: {answer['sentence']}{where}")
    return [*told, document["trouble"]] if document["trouble"] else told
