"""Why the robot drives where it drives, as the client gives it."""

from __future__ import annotations

from onemap import Choice, SearchSnapshot

OPTION = {
    "kind": "frontier",
    "xy_m": [1, 2],
    "score": 0.5,
    "travel_m": 3,
    "utility": 0.4,
    "chosen": True,
}
CHOICE = {"number": 2, "sentence": "the only goal", "options": [OPTION]}
REPORT = {"id": "s1", "state": "exploring", "objects": ["sofa"], "results": []}


def test_a_choice_has_its_options() -> None:
    choice = Choice.of(CHOICE)
    assert (choice.number, choice.sentence, choice.left_out) == (2, "the only goal", 0)
    (option,) = choice.options
    assert (option.kind, option.xy_m, option.chosen) == ("frontier", (1.0, 2.0), True)
    assert (option.score, option.travel_m, option.utility) == (0.5, 3.0, 0.4)


def test_a_snapshot_may_lack_a_choice() -> None:
    assert SearchSnapshot.of(REPORT).choice is None
    assert SearchSnapshot.of({**REPORT, "choice": None}).choice is None
    assert SearchSnapshot.of({**REPORT, "choice": CHOICE}).choice == Choice.of(CHOICE)
