"""Requests as people make them: each is understood, or refused; none is taken for another."""

import json
from collections import Counter
from typing import Any

from onemap_shared.messages import RelationKind
from onemap_shared.names import normalised
from onemap_shared.sentence import listed_sentences, parse
from tests.structure import ROOT

# Written by people who knew what can be asked for and no rule of the grammar, with what a careful
# reader takes from each.
REQUESTS = json.loads((ROOT / "tests/data/requests.json").read_text(encoding="utf-8"))
RELATION_NAMES = {RelationKind.NEXT_TO: "near", RelationKind.IN: "inside"}
# Names of no thing in the apartment: whether one is known is for the encoder to say.
FOR_THE_ENCODER = {"unknown word", "person", "not a thing", "other attribute"}
READ_OTHERWISE = ["pls find teh freezer"]  # that no word is "teh" is for the encoder to say


def meaning(text: str) -> dict[str, Any] | None:
    """What a text asks for, as the file says it; None if it is refused."""
    objects: list[dict[str, Any]] = []
    stay_out: list[str] = []
    try:
        sentences = [parse(each, ()) for each in listed_sentences(text)]
    except ValueError:
        return None
    for each in sentences:
        said: dict[str, Any] = {"name": each.name, "colour": each.detail.colour}
        for relation in each.detail.relations:
            name = RELATION_NAMES.get(relation.kind, relation.kind.value)
            said.setdefault(name, []).extend(relation.anchors)
        said["in_rooms"], said["not_in_rooms"] = each.detail.inside, each.detail.outside
        said["not"] = each.detail.negatives
        objects.append(said)
        stay_out += each.stay_out
        if set(each.unknown_places([])) - set(each.stay_out):
            return None
    return plain({"objects": objects, "stay_out_of": stay_out})


def plain(means: dict[str, Any]) -> dict[str, Any]:
    """Without empty members, cases, articles, plurals and the order of names."""

    def same(value: Any) -> Any:
        return value if isinstance(value, str) else sorted(map(singular, value))

    objects = []
    for each in means["objects"]:
        said = {key: same(value) for key, value in each.items() if value}
        objects.append({**said, "name": singular(each["name"])})
    return {"objects": objects, "stay_out_of": same(means.get("stay_out_of", ()))}


def singular(name: str) -> str:
    return normalised(name).removesuffix("s")


def test_each_request_is_understood_or_refused_and_none_is_taken_for_another() -> None:
    table: dict[str, Counter[str]] = {}
    wrong = []
    for request in REQUESTS:
        found = meaning(request["text"])
        right = None if "refused" in request else plain(request["means"])
        verdict = "right" if found == right else "refused" if found is None else "wrong"
        if verdict == "wrong" and request.get("refused") not in FOR_THE_ENCODER:
            wrong.append((request["text"], found))
        table.setdefault(request["kind"], Counter())[verdict] += 1
    assert [text for text, _ in wrong] == READ_OTHERWISE, wrong
    asked = {kind: counts for kind, counts in table.items() if kind != "refused"}
    assert sum(each["right"] for each in asked.values()) >= 290, table  # of 368
