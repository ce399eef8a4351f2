"""What agents get from a tool: a sentence that says what is so or was done, and the numbers."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import BaseModel, Field

from onemap.replies import (
    LookedArea,
    MapObject,
    MapPose,
    MapStatistics,
    QueryResult,
    Region,
    SearchSnapshot,
    rfc3339,
)
from onemap_gateway.present.service_status import sentence
from onemap_shared.messages import SearchOrder, SearchState, Verdict


class AgentReply(BaseModel):
    """The reply of a tool."""

    summary: str = Field(description="The reply in words.")


class PlacesReply(AgentReply):
    """Where something is, or may be."""

    found: tuple[MapObject, ...] = Field(description="Of this name, confirmed by a search.")
    likely: tuple[Region, ...] = Field(description="Regions that look like it, not confirmed.")
    did_you_mean: tuple[str, ...] = Field(
        description="The nearest known words, if there are no regions."
    )
    map_age_s: float | None = Field(description="Age of the newest frame in the map.")
    verdict: Verdict = Field(
        description="By the map alone: found, not_here or not_looked_yet (search for it)."
    )
    looked: LookedArea


class FoundObjectsReply(AgentReply):
    """The objects that searches found, the one found last first."""

    objects: tuple[MapObject, ...]


class MapReply(AgentReply):
    """The map, the robot on it, and whether they work."""

    ready: bool = Field(description="Whether frames reach the map and all services are there.")
    problem: str = Field(description="The reason why not; empty if all is well.")
    map: MapStatistics
    robot: MapPose | None = Field(description="null: no pose yet.")


class SeenObjectReply(AgentReply):
    """A found object; its picture is beside this reply."""

    object: MapObject


class AgentSearchReply(AgentReply):
    """A search; the summary says what the call did."""

    search: SearchSnapshot | None = Field(description="null: there has been none.")


def places_reply(reply: QueryResult, found: tuple[MapObject, ...]) -> PlacesReply:
    """Confirmed places before likely ones."""
    parts = [f"{_place(kept)} was found there by a search." for kept in found]
    if reply.regions:
        best = reply.regions[0]
        parts.append(
            f"{len(reply.regions)} regions of the map look like {reply.text!r}, the best at "
            f"{_xy(best.centre_m)} with the score {best.score:.2f}; no search confirmed that."
        )
    elif reply.message:
        parts += [reply.message, reply.sentence]
    return PlacesReply(
        summary=" ".join(parts),
        found=found,
        likely=reply.regions,
        did_you_mean=reply.did_you_mean,
        map_age_s=reply.age_s,
        verdict=Verdict(reply.verdict),
        looked=reply.looked,
    )


def found_objects_reply(objects: tuple[MapObject, ...]) -> FoundObjectsReply:
    """All found objects by name."""
    summary = "No search has found anything on this map yet."
    if objects:
        summary = f"Found so far: {', '.join(map(_place, objects))}."
    return FoundObjectsReply(summary=summary, objects=objects)


def map_reply(info: MapStatistics, robot: MapPose | None, problem: str) -> MapReply:
    """The map in numbers and words; ``problem``: why it is not updated, empty if it is."""
    stands = "no pose of the robot is known"
    if robot is not None:
        stands = f"the robot stands at {_xy((robot.x_m, robot.y_m))}"
    summary = (
        f"The map shows {info.free_m2:.1f} m2 of free floor and {info.occupied_m2:.1f} m2 of "
        f"obstacles from {info.frames_fused} frames; {stands}."
    )
    return MapReply(
        summary=f"{summary} {problem}".rstrip(),
        ready=not problem,
        problem=problem,
        map=info,
        robot=robot,
    )


def seen_object_reply(kept: MapObject) -> SeenObjectReply:
    """A found object and whether there is a picture of it."""
    picture = "the picture is from then" if kept.picture else "there is no picture of it"
    return SeenObjectReply(
        summary=f"{_place(kept)} was last seen at {rfc3339(kept.last_seen_at)}; {picture}.",
        object=kept,
    )


def started_summary(report: SearchSnapshot, max_distance_m: float, max_time_s: float) -> str:
    """What starting a search did."""
    order = "in the cheapest order" if report.order == SearchOrder.ANY else "in this order"
    order = f" {order}" if len(report.objects) > 1 else ""
    return (
        f"Started the search {report.id} for {_subject(report)}{order}: the robot drives now, at "
        f"most {max_distance_m:g} m and {max_time_s:g} s. 'search_status' says how it goes, "
        "'stop' ends it."
    )


def stopped_summary(report: SearchSnapshot, *, had_ended: bool) -> str:
    """What stopping a search did; ``had_ended``: it was over before."""
    if had_ended or report.state != SearchState.CANCELLED:
        return (
            f"The search {report.id} for {_subject(report)} had ended before as {report.state}: "
            "there was nothing to stop."
        )
    return (
        f"Stopped the search {report.id} for {_subject(report)} after {_spent(report)}: the robot "
        f"brakes and stands.{_found(report)}"
    )


def progress_summary(report: SearchSnapshot) -> str:
    """How a search goes, or how it ended."""
    return (
        f"The search {report.id} for {_subject(report)} is {report.state} after {_spent(report)}: "
        f"{sentence(report.reason)}{_found(report)}"
    )


def _subject(report: SearchSnapshot) -> str:
    return f"the place {_xy(report.place_m)}" if report.place_m else _names(report.objects)


def _spent(report: SearchSnapshot) -> str:
    return f"{report.elapsed_s:.0f} s and {report.path_length_m:.1f} m"


def _found(report: SearchSnapshot) -> str:
    names = [result.name for result in report.results if result.found]
    return f" Found: {_names(names)}." if names else ""


def _place(kept: MapObject) -> str:
    return f"{kept.name!r} ({kept.id}) at {_xy(kept.position_m)}"


def _xy(place_m: Sequence[float]) -> str:
    return f"x {place_m[0]:.2f} m, y {place_m[1]:.2f} m"


def _names(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names))
