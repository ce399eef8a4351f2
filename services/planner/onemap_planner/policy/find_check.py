"""Whether a candidate is as described, by what the map shows and what the detector found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.state import Evidence, FoundObject
from onemap_planner.world.candidates import MIN_SIGHTINGS, ObjectCandidate
from onemap_planner.world.colours import TOO_DARK, has_colour
from onemap_planner.world.description import Description
from onemap_planner.world.map_view import MapView
from onemap_shared.conditions import MAYBE, Candidate, Surroundings, Thing, check
from onemap_shared.geometry import I64
from onemap_shared.messages import CheckedCondition, Holds
from onemap_shared.names import same_name

NOT_ON_MAP = (CheckedCondition("on the map", Holds.NOT_CHECKED, "perhaps not on the map any more"),)


def check_find(
    candidate: ObjectCandidate,
    context: PlanningContext,
    evidence: Evidence,
    found_objects: Sequence[FoundObject] = (),
) -> tuple[CheckedCondition, ...]:
    """The verdict on each condition of the description; none without one.

    An anchor is where the map shows it, and certainly where it was found. Where the map shows that
    it may be, so that a query leaves it to check, ``MIN_SIGHTINGS`` detections settle that it is.
    """
    description, map_view = context.description, context.map_view
    if description is None:
        return ()
    cells = map_view.indices_of(candidate.surface)
    if len(cells) == 0:
        return NOT_ON_MAP
    detail = description.detail
    colour = has_colour(candidate.best_view, detail.colour) if detail.colour else (Holds.YES, "")
    thing = Thing(cells, candidate.xyz[2])
    around = _surroundings(description, map_view, evidence, found_objects)
    if colour[1] == TOO_DARK:  # so it was for the map
        around = replace(around, likeness=None)
    return check(Candidate(thing, colour, alone=not candidate.supported), detail, around)


def _shown(anchor: ObjectCandidate, name: str, description: Description, map_view: MapView) -> I64:
    """The cells (K, 2) of a detected anchor where the map shows that it may be."""
    cells = map_view.indices_of(anchor.surface)
    shown: I64 = cells[description.anchors[name][tuple(cells.T)] >= MAYBE]
    return shown


def _surroundings(
    description: Description,
    map_view: MapView,
    evidence: Evidence,
    found_objects: Sequence[FoundObject],
) -> Surroundings:
    things: dict[str, list[Thing]] = {}
    for name in description.anchors:
        detected = (c for c in evidence.anchors.get(name, ()) if c.sightings >= MIN_SIGHTINGS)
        things[name] = [*description.found.get(name, ())]
        things[name] += [Thing(_shown(c, name, description, map_view), c.xyz[2]) for c in detected]
        found = (each for each in found_objects if same_name(each.name, name))
        things[name] += [Thing(map_view.indices_of(each.cells), each.height_m) for each in found]
    return Surroundings(
        map_view.grid,
        map_view.occupancy,
        map_view.explored,
        map_view.similarity,
        dict(description.anchors),
        description.places,
        description.shown,
        description.settled,
        {name: [each for each in known if len(each.cells)] for name, known in things.items()},
        map_view.likeness,
    )
