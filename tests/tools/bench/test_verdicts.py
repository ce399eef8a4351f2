"""A drive through a room of boxes, asked at every stage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench import verdicts
from onemap_tools.bench.queries import EncoderPair
from onemap_tools.bench.query_report import QueryWord
from onemap_tools.bench.verdicts import STAGES, VerdictBenchParams, asked_words, explored
from tests.perception.toy import ColourEncoder
from tests.simulator.scenes import box_room


@pytest.fixture(scope="module")
def room() -> Scene:
    return box_room()


def test_names_and_some_unrelated_words_are_asked() -> None:
    words = asked_words(load_vocabulary(SHIPPED))
    groups = {word.group for word in words}
    assert groups == {"names", "unrelated"}
    assert all(not word.category for word in words if word.group == "unrelated")


def test_a_drive_shows_more_and_more_until_nothing_is_hidden(room: Scene) -> None:
    encoder = ColourEncoder()
    words = (QueryWord("red", "sofa", "names"), QueryWord("blue", "", "unrelated"))
    questions = list(zip(words, EncoderPair(encoder, encoder).queries(words), strict=True))
    outcomes = list(explored(room, encoder, questions, 5))
    assert len(outcomes) == len(words) * len({one.stage for one in outcomes})
    assert {one.stage for one in outcomes} <= set(STAGES)
    reds = [one for one in outcomes if one.text == "red"]
    assert all(one.present for one in reds)
    assert (reds[-1].shown, reds[-1].near) == (True, True)
    assert reds[-1].hidden_m2 < 0.5
    hidden, shares = [one.hidden_m2 for one in reds], [one.looked_share for one in reds]
    assert (np.diff(hidden) <= 0).all()
    assert shares[-1] > shares[0]
    assert not any(one.present or one.near for one in outcomes if one.text == "blue")


def test_a_stopped_run_goes_on(
    room: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    encoder = ColourEncoder()
    made: list[int] = []

    def apartment(seed: int, _style: object) -> Scene:
        made.append(seed)
        return room

    monkeypatch.setattr(verdicts, "generate_apartment", apartment)
    monkeypatch.setattr(verdicts, "encoder_pair", lambda _: EncoderPair(encoder, encoder))
    word = QueryWord("red", "sofa", "names")
    monkeypatch.setattr(verdicts, "asked_words", lambda _: (word,))
    monkeypatch.setattr(verdicts, "STAGES", (0.1, 0.2))
    out = tmp_path / "finished.jsonl"
    reported: list[str] = []
    first = verdicts.run(
        object(),  # type: ignore[arg-type]
        VerdictBenchParams((4,), "training", out),
        reported.append,
    )
    both = verdicts.run(
        object(),  # type: ignore[arg-type]
        VerdictBenchParams((4, 5), "training", out),
        reported.append,
    )
    assert made == [4, 5]
    assert [one.seed for one in both] == [4, 4, 5, 5]
    assert both[:2] == first
    assert reported == ["apartment 4: 2 stages", "apartment 5: 2 stages"]
