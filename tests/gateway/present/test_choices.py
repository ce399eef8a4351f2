"""Why the robot drives where it drives, as clients get it."""

from __future__ import annotations

from dataclasses import replace

from onemap_gateway.present.choices import CHOICE_EXAMPLE, ChoiceReport, choice_report
from onemap_gateway.present.views import search_report
from onemap_shared.messages import NO_CHOICE
from tests.gateway import fakes


def test_a_choice_is_reported_in_decimals_that_people_read() -> None:
    report = search_report(replace(fakes.search(), choice=fakes.CHOICE), fakes.STAMP_NS).choice
    assert report is not None
    assert report.model_dump() == {
        "number": 2,
        "sentence": "utility 0.52, 0.11 more than the region at (1.5, 1.2): it opens a wider view",
        "options": [
            {
                "kind": "frontier",
                "xy_m": (0.6, 0.4),
                "score": 0.556,
                "travel_m": 1.235,
                "utility": 0.52,
                "chosen": True,
            },
            {
                "kind": "region",
                "xy_m": (1.5, 1.2),
                "score": 0.61,
                "travel_m": 5.0,
                "utility": 0.41,
                "chosen": False,
            },
        ],
        "left_out": 3,
    }


def test_without_a_goal_there_is_no_choice() -> None:
    assert choice_report(NO_CHOICE) is None
    assert choice_report(replace(NO_CHOICE, number=7)) is None


def test_the_example_is_one() -> None:
    assert ChoiceReport.model_validate(CHOICE_EXAMPLE).options[0].chosen
