"""What the schemas of replies do not say by themselves: closed lists of values, and examples."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Any

from onemap.replies import (
    Choice,
    ChoiceOption,
    LookedArea,
    MapObject,
    MapPose,
    QueryResult,
    Region,
    SearchSnapshot,
    StoredMap,
    moment,
    rfc3339,
)
from onemap_shared.messages import FailureCode, SearchKind, SearchState, Verdict

Document = dict[str, Any]

# The replies themselves have plain texts, so that an older client can read a newer value.
CLOSED_LISTS: Mapping[str, Mapping[str, type[Enum]]] = {
    "SearchSnapshot": {"kind": SearchKind, "state": SearchState},
    "ObjectOutcome": {"outcome": SearchState},
    "ReplayStep": {"state": SearchState},
    "QueryResult": {"verdict": Verdict},
}
REASONS = " ".join(f"`{code}`: {code.sentence}" for code in FailureCode if code)

START_NS = 1_767_225_600_000_000_000  # 2026-01-01
LATER_NS = START_NS + 12_400_000_000
FOUND = QueryResult(
    text="sofa",
    verdict="found",
    sentence="'sofa' is at (2.35, -1.10) m.",
    regions=(
        Region(
            rank=1,
            centre_m=(2.35, -1.1),
            extent_m=(1.5, -1.6, 3.2, -0.6),
            outline_m=((1.5, -1.6), (3.2, -1.6), (3.2, -0.6), (1.5, -0.6)),
            score=0.91,
            variance=0.04,
            height_m=(0.1, 0.9),
            last_seen_at=rfc3339(moment(LATER_NS)),
            best_view=MapPose(x_m=0.6, y_m=-0.4, yaw_rad=-0.38),
        ),
    ),
    looked=LookedArea(
        share=0.62, looked_m2=31.5, not_looked_m2=19.3, frontiers=4, frontier_m=(5.15, 0.45)
    ),
    revision=412,
    age_s=0.21,
    encoder_id="mini-1",
    best_score=0.91,
    calibrated=True,
)
ABSENT = FOUND.model_copy(
    update={
        "text": "piano",
        "verdict": "not_looked_yet",
        "sentence": "'piano' was not seen, but only 62 % of the reachable area was looked at; "
        "look next beyond the edge of the map at (5.15, 0.45) m.",
        "regions": (),
        "best_score": 0.04,
        "message": "Nothing on the map looks like 'piano': the best score is 0.04, and answers "
        "begin at 0.22.",
    }
)
OPTIONS = (
    ("frontier", (1.8, -0.4), 0.55, 1.2, 0.52, True),
    ("region", (4.1, 0.3), 0.61, 5.0, 0.41, False),
)
CHOICE = Choice(
    number=3,
    sentence="going to the unexplored space 2 m ahead to the right: it is the nearest",
    options=tuple(
        ChoiceOption.of(dict(zip(ChoiceOption.model_fields, option, strict=True)))
        for option in OPTIONS
    ),
)
SEARCH = SearchSnapshot(
    id="8f14e45f",
    state="exploring",
    objects=("sofa", "kettle"),
    reason=CHOICE.sentence,
    results=(),
    target="sofa",
    choice=CHOICE,
    elapsed_s=12.4,
    path_length_m=3.2,
    started_ns=START_NS,
    updated_ns=LATER_NS,
)
SAVED_MAP = StoredMap(
    name="flat",
    file_bytes=2514932,
    saved_ns=LATER_NS,
    encoder_id="mini-1",
    text_space="minilm",
    cell_size_m=0.1,
    cells_observed=8132,
    frames_fused=412,
    problem="",
)
BED = MapObject(
    id="3f9a12c4",
    name="bed",
    position_m=(3.42, -1.15, 0.41),
    extent_m=(2.5, -2.1, 4.4, -0.3),
    height_m=(0.1, 0.7),
    score=0.93,
    times_found=2,
    search_id="8f14e45f",
    first_found_ns=LATER_NS,
    last_seen_ns=START_NS + 591_000_000_000,
    box_px=(120.0, 184.5, 512.0, 402.0),
    picture="/v1/objects/3f9a12c4.jpg",
)
EXAMPLES: Mapping[str, list[Document]] = {
    "SearchSnapshot": [SEARCH.document],
    "QueryResult": [FOUND.document, ABSENT.document],
    "StoredMap": [SAVED_MAP.document],
    "MapObject": [BED.document],
}


def complete(schemas: Mapping[str, Document]) -> None:
    """Add closed lists and examples to the schemas of replies, by the names of their models."""
    for name, fields in CLOSED_LISTS.items():
        for field, values in fields.items() if name in schemas else ():
            schemas[name]["properties"][field]["enum"] = [value.value for value in values]
    for name in ("SearchSnapshot", "ObjectOutcome"):
        if name in schemas:
            reason = schemas[name]["properties"]["reason_code"]
            reason["description"] += f" {REASONS}"
            reason["anyOf"][0]["enum"] = [code.value for code in FailureCode if code]
    for name, examples in EXAMPLES.items():
        if name in schemas:
            schemas[name]["examples"] = examples
