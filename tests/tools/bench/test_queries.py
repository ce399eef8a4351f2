"""The floor is chosen from unrelated words, and the rates say what it costs."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from onemap_perception.encoders.mini import SHIPPED, MiniEncoder, MiniParams
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench import queries
from onemap_tools.bench.mapping import map_scene
from onemap_tools.bench.queries import (
    EncoderPair,
    QueryBenchParams,
    QueryOutcome,
    QueryWord,
    choose_floor,
    failing,
    query_map,
    query_words,
    rates,
    summarise,
)
from onemap_tools.cli.app import app
from tests.perception.toy import ColourEncoder
from tests.simulator.scenes import box_room

SOFA, LOO = QueryWord("sofa", "sofa", "names"), QueryWord("loo", "toilet", "synonyms")
TOILET, CAR = QueryWord("toilet", "toilet", "names"), QueryWord("car", "", "unrelated")


def outcomes(
    word: QueryWord, score: float, *, near: bool | None = None, seed: int = 1
) -> QueryOutcome:
    """``near`` None: the thing is absent."""
    return QueryOutcome(word, seed, near is not None, score, bool(near))


def test_rates_count_absent_and_present_words_apart() -> None:
    answers = [
        outcomes(SOFA, 0.9, near=True),
        outcomes(SOFA, 0.5, near=False),
        outcomes(SOFA, 0.1, near=True),
        outcomes(SOFA, 0.4),
        outcomes(SOFA, 0.2),
    ]
    assert rates(answers, 0.3) == {
        "absent": 2,
        "false_positive_rate": 0.5,
        "present": 3,
        "answered_rate": 0.667,
        "right_rate": 0.333,
    }
    assert rates([], 0.3)["right_rate"] is None


def test_the_floor_lets_one_unrelated_word_in_twenty_through() -> None:
    answers = [outcomes(CAR, score) for score in np.linspace(0.005, 0.195, 20)]
    floor = choose_floor([*answers, outcomes(SOFA, 0.99)])
    assert floor == 0.19
    assert rates(answers, floor)["false_positive_rate"] == 0.05
    with pytest.raises(ValueError, match="no floor"):
        choose_floor([outcomes(CAR, 0.999)])


def test_the_floor_is_chosen_on_odd_and_measured_on_even_seeds() -> None:
    odd = [outcomes(CAR, 0.105, seed=801), outcomes(SOFA, 0.9, near=True, seed=801)]
    even = [outcomes(CAR, 0.5, seed=802), outcomes(SOFA, 0.1, near=True, seed=802)]
    found = summarise([*odd, *even], QueryBenchParams((801, 802)))
    assert found["floor"] == 0.11
    assert found["rates"]["unrelated"]["false_positive_rate"] == 1.0
    assert found["rates"]["names"]["right_rate"] == 0.0
    assert found["without_floor"]["names"]["right_rate"] == 1.0


def test_words_that_fail_where_their_class_does_not_are_listed() -> None:
    answers = [
        outcomes(TOILET, 0.9, near=True),
        outcomes(LOO, 0.9, near=False),
        outcomes(LOO, 0.1, near=True),
    ]
    assert failing(answers, 0.2) == {"loo": 0.0}
    assert failing([*answers[:1], outcomes(LOO, 0.8, near=True)], 0.2) == {}


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
    mapped = map_scene(room, encoder, seed=3, pictures=12)
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


def test_the_command_prints_one_object(monkeypatch: pytest.MonkeyPatch, room: Scene) -> None:
    monkeypatch.setattr(queries, "generate_apartment", lambda seed, style: room)
    arguments = ["bench", "queries", "--apartments", "2", "--pictures", "3", "--style", "training"]
    result = CliRunner().invoke(app, [*arguments, "--json"])
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout.splitlines()[-1])
    assert document["benchmark"] == "queries"
    assert 0 < document["floor"] < 1
    assert set(document["rates"]) == {"names", "synonyms", "aliases", "unrelated"}


def test_too_few_apartments_are_refused() -> None:
    result = CliRunner().invoke(app, ["bench", "queries", "--apartments", "1"])
    assert result.exit_code == 2
    assert "between 2 and 100" in result.output
