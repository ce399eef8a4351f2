from __future__ import annotations

import json
from dataclasses import replace

import pytest

from onemap_tools.bench.navigation.records import Failure, episode_record
from tests.tools.bench.navigation.records import episode, failed, found

RECORD = episode(3, found("bed", 4, 8), failed("fan", 2, Failure.NOT_DETECTED), contacts=1)


def test_a_record_survives_its_json_line() -> None:
    assert episode_record(json.loads(json.dumps(RECORD.document(), allow_nan=False))) == RECORD


def test_stairwells_survive_too() -> None:
    opened = replace(RECORD, stairwells=((1.0, 2.0, 1.5, 3.0),), edges_crossed=1)
    assert episode_record(json.loads(json.dumps(opened.document(), allow_nan=False))) == opened


def test_progress_counts_what_was_found_before_the_first_failure() -> None:
    assert RECORD.progress == 1
    assert episode(0, found("bed", 1, 1), found("fan", 1, 1)).progress == 2


@pytest.mark.parametrize("changed", [{"objects": [{}]}, {"start": [1]}, {"more": 1}])
def test_other_documents_are_refused(changed: dict[str, object]) -> None:
    with pytest.raises((ValueError, KeyError, TypeError)):
        episode_record({**RECORD.document(), **changed})
