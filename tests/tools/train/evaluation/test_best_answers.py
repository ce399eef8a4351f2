"""Trust in best answers: a right, a doubtful and a boastful encoder."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_tools.train.evaluation.best_answers import BestAnswers, best_answers
from tests.tools.train.tiny import VOCABULARY, PerfectEncoder, tiny_frames


def collected(score: list[float], label: int) -> BestAnswers:
    """Two words and one stranger, an image of one patch."""
    answers = BestAnswers(("wall", "sofa"), ("piano",))
    answers.add(np.array([score], np.float32), np.full((8, 8), label, np.uint8))
    return answers


def test_a_sure_and_right_answer_has_no_error() -> None:
    summary = collected([0.0, 1.0], 1).summary()
    assert summary["calibration_error"] == 0
    assert (summary["right"], summary["wrong_of_sure"]) == (1, 0)


def test_a_sure_and_wrong_answer_has_the_greatest() -> None:
    summary = collected([1.0, 0.0], 1).summary()
    assert summary["calibration_error"] == 1
    assert summary["wrong_of_sure"] == 1


def test_a_stranger_is_never_right_and_is_reported() -> None:
    summary = collected([0.9, 0.1], 2).summary()
    assert summary["right"] == 0
    piano = summary["strangers"]["piano"]
    assert piano == {"patches": 1, "sure": 1.0, "taken_for": "wall", "share": 1.0}
    assert collected([0.9, 0.1], 0).summary()["strangers"]["piano"] == {"patches": 0}


def test_mixed_patches_do_not_count() -> None:
    answers = BestAnswers(("wall", "sofa"))
    label = np.zeros((8, 16), np.uint8)
    label[:, 12:] = 1
    answers.add(np.array([[0.9, 0.1], [0.9, 0.1]], np.float32), label)
    assert answers.summary()["patches"] == 1


def test_frames_are_encoded_and_reported() -> None:
    frames, done = tiny_frames(), list[int]()
    pairs = list(zip(frames.rgb, frames.label, strict=True))
    summary = best_answers(PerfectEncoder(), VOCABULARY.names, pairs, done.append)
    assert done == [1, 2, 3, 4, 5, 6]
    assert summary["right"] == pytest.approx(1, abs=0.05)
