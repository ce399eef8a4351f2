"""The closed list of reasons of a failure."""

from __future__ import annotations

from onemap_shared.messages import FailureCode


def test_every_code_has_a_sentence_of_its_own() -> None:
    sentences = [code.sentence for code in FailureCode if code]
    assert all(sentence.endswith(".") for sentence in sentences)
    assert len(set(sentences)) == len(sentences) == len(FailureCode) - 1
    assert (str(FailureCode.STUCK), FailureCode.NONE.sentence) == ("stuck", "")
