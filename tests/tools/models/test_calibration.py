"""The floor of an encoder: what is asked, of which maps, and what it costs."""

from __future__ import annotations

import json

import numpy as np
import pytest

from onemap_simulator.scene.scene import Scene
from onemap_tools.models import calibration
from onemap_tools.models.calibration import QueryOutcome, QueryWord
from tests.simulator.scenes import box_room

SOFA, CAR = QueryWord("sofa", "sofa", "names"), QueryWord("car", "", "unrelated")


@pytest.fixture(scope="module")
def room() -> Scene:
    return box_room()


def outcome(
    word: QueryWord, score: float, *, near: bool | None = None, seed: int = 1
) -> QueryOutcome:
    """``near`` None: the thing is absent."""
    return QueryOutcome(word, seed, near is not None, score, bool(near))


def test_the_report_holds_rates_of_every_group_and_becomes_a_table(
    monkeypatch: pytest.MonkeyPatch, room: Scene
) -> None:
    monkeypatch.setattr(calibration, "generate_apartment", lambda seed, style: room)
    told: list[str] = []
    document = calibration.calibrate(None, 2, told.append, images=1)
    assert document["images"] == 1
    assert document["encoder_id"].startswith("mini-")
    assert told == ["1 of 2 apartments", "2 of 2 apartments"]
    assert 0 < document["floor"] < 1
    assert set(document["rates"]) == {"names", "synonyms", "aliases", "unrelated"}
    json.dumps(document, allow_nan=False)
    head, columns, *rows = calibration.lines(document)
    assert f"floor {document['floor']:g}" in head
    assert columns.split()[0] == "words"
    assert [row.split()[0] for row in rows] == list(document["rates"])


def test_the_floor_lets_one_unrelated_word_in_twenty_through() -> None:
    answers = [outcome(CAR, score) for score in np.linspace(0.005, 0.195, 20)]
    floor = calibration.choose_floor([*answers, outcome(SOFA, 0.99)])
    assert floor == 0.19
    assert calibration.rates(answers, floor)["false_positive_rate"] == 0.05
    with pytest.raises(ValueError, match="no floor"):
        calibration.choose_floor([outcome(CAR, 0.999)])


def test_the_floor_is_chosen_on_odd_and_measured_on_even_seeds() -> None:
    odd = [outcome(CAR, 0.105, seed=801), outcome(SOFA, 0.9, near=True, seed=801)]
    even = [outcome(CAR, 0.5, seed=802), outcome(SOFA, 0.1, near=True, seed=802)]
    found = calibration.summarise([*odd, *even])
    assert found["floor"] == 0.11
    assert found["rates"]["unrelated"]["false_positive_rate"] == 1.0
    assert found["rates"]["names"]["right_rate"] == 0.0
    assert found["without_floor"]["names"]["right_rate"] == 1.0
