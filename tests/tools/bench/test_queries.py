"""What is queried, and the replies of maps made here."""

from __future__ import annotations

import json

import pytest

from onemap_perception.encoders.mini import SHIPPED, MiniEncoder, MiniParams
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench import queries
from onemap_tools.bench.mapping import map_scene
from onemap_tools.bench.queries import (
    STYLES,
    EncoderPair,
    query_map,
    query_words,
    run_configured,
)
from onemap_tools.bench.query_report import QueryBenchParams, QueryWord, table_lines
from tests.perception.toy import ColourEncoder
from tests.simulator.scenes import box_room


def test_what_is_asked_needs_no_sentence_encoder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_perception.encoders.mini.find_model_folder", lambda: None)
    vocabulary = load_vocabulary(SHIPPED)
    words = query_words(vocabulary)
    MiniEncoder(MiniParams()).embed_text([word.text for word in words])
    named = {
        word for e in vocabulary.classes for word in (*e.aliases, *e.held_out, *e.query_aliases)
    }
    assert not named & {word.text for word in words if word.group == "unrelated"}
    assert {"floor", "wall", "ceiling"}.isdisjoint(word.category for word in words)


@pytest.fixture(scope="module")
def room() -> Scene:
    return box_room()


def test_a_map_made_here_knows_what_it_was_shown(room: Scene) -> None:
    encoder = ColourEncoder()
    mapped = map_scene(room, encoder, seed=3, images=12)
    assert mapped.observed >= {"sofa", "ball", "floor"}
    assert mapped.belief.frames_fused == 12
    words = (
        QueryWord("red", "sofa", "names"),
        QueryWord("blue", "", "unrelated"),
        QueryWord("green", "bed", "names"),
    )
    questions = list(zip(words, EncoderPair(encoder, encoder).queries(words), strict=True))
    red, blue, green = query_map(mapped, questions, 3)
    assert (red.present, red.near) == (True, True)
    assert (blue.present, blue.near) == (False, False)
    assert not green.present
    assert red.score > blue.score


def test_the_report_holds_rates_of_every_group_and_becomes_a_table(
    monkeypatch: pytest.MonkeyPatch, room: Scene
) -> None:
    monkeypatch.setattr(queries, "generate_apartment", lambda seed, style: room)
    params = QueryBenchParams((800, 801), STYLES["training"], images=3)
    done: list[int] = []
    document = run_configured(MiniParams(), params, done.append)
    assert (document["benchmark"], document["pictures"]) == ("queries", 3)
    assert document["encoder_id"].startswith("mini-")
    assert done == [1, 2]
    assert 0 < document["floor"] < 1
    assert set(document["rates"]) == {"names", "synonyms", "aliases", "unrelated"}
    json.dumps(document, allow_nan=False)
    head, columns, *rows = table_lines(document)
    assert f"floor {document['floor']:g}" in head
    assert columns.split()[0] == "words"
    assert [row.split()[0] for row in rows] == list(document["rates"])
