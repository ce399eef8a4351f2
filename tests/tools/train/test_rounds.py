"""What a network was trained with is written down and read again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from onemap_tools.train.rounds import (
    TRAINING_FILE,
    TrainingRound,
    difference,
    dump_rounds,
    parse_rounds,
    read_rounds,
    write_rounds,
)

FIRST = TrainingRound(steps=7500, seed=0, pictures=12_000, apartments=750, frozen_stride=4)
SECOND = replace(FIRST, steps=9000, seed=1, frozen_stride=2)


def test_rounds_are_read_as_they_were_written(tmp_path: Path) -> None:
    write_rounds(tmp_path, (FIRST, SECOND))
    assert read_rounds(tmp_path) == parse_rounds(dump_rounds((FIRST, SECOND))) == (FIRST, SECOND)


def test_weights_without_a_record_have_none(tmp_path: Path) -> None:
    assert read_rounds(tmp_path) == ()


@pytest.mark.parametrize("text", ["", "{}", '{"rounds": [{"steps": 1}]}', '{"rounds": 3}'])
def test_a_damaged_record_names_its_file(tmp_path: Path, text: str) -> None:
    (tmp_path / TRAINING_FILE).write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=TRAINING_FILE):
        read_rounds(tmp_path)


def test_a_difference_names_both_values() -> None:
    assert difference(FIRST, FIRST) == ""
    text = difference(FIRST, SECOND)
    assert (
        text == "steps 7500 rather than 9000, seed 0 rather than 1, frozen stride 4 rather than 2"
    )
