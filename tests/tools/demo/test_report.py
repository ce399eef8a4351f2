"""The printed summary of a demo."""

from __future__ import annotations

import io
from dataclasses import replace
from math import nan
from pathlib import Path

import cv2
import numpy as np
import pytest
from rich.console import Console

from onemap_shared.geometry import U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy, SearchView
from onemap_tools.demo.report import MIN_PIXELS_PER_CELL, DrivenPath, describe, write_picture
from onemap_tools.demo.summary import DemoSummary, ObjectSummary, RobotSummary

OBJECTS = (
    ObjectSummary(
        "refrigerator", "found", "seen", (10.11, 10.43, 1.0), 112.4, 25.2, 17.1, 0.8, 0.0
    ),
    ObjectSummary(
        "sofa", "found", "seen [3] times", (1.0, 2.0, 0.4), 30.0, 8.0, 7.0, 2.6, 1.1, "armchair"
    ),
    ObjectSummary("toilet", "not_found", "searched it all", (), 60.0, 14.0, nan, nan, nan),
)
NAMES = tuple(item.name for item in OBJECTS)


def printed(summary: DemoSummary, *, picture: str | None = None) -> str:
    console = Console(file=io.StringIO(), width=80)
    describe(summary, {"picture": picture}, console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_row_per_object_fits_eighty_columns() -> None:
    text = printed(DemoSummary(NAMES, OBJECTS, 210.0, 202.4, 7.4))
    lines = [line for line in text.splitlines() if line.strip().startswith("refrigerator")]
    for part in ("found", "(10.1, 10.4)", "112 s", "25.2 m", "17.1 m", "0.68", "0.8 m"):
        assert part in lines[0]
    assert "…" not in text


def test_wrong_claims_and_failures_have_their_reason() -> None:
    text = printed(DemoSummary(NAMES, OBJECTS, 210.0, 202.4, 7.4))
    assert "wrong one" in text
    assert "sofa: seen [3] times (nearest to the claimed place: armchair)" in text
    assert "toilet: searched it all\n" in text
    assert "1 of 3 found in 202 s" in text
    assert "1 claimed wrongly" in text


def test_results_without_ground_truth_are_marked() -> None:
    unknown = replace(OBJECTS[0], judged=False, goal_distance_m=nan, shortest_path_m=nan)
    text = printed(DemoSummary(("a",), (unknown,), 210.0, 202.4, 7.4))
    assert "found (no" in text
    assert "wrong" not in text
    assert "SPL 0" not in text
    assert "1 of 1 found in 202 s (210 s with starting up), no ground truth" in flat(text)
    assert "…" not in text
    mixed = printed(DemoSummary(("a", "b"), (unknown, OBJECTS[1]), 210.0, 202.4, 7.4))
    assert "ground truth for 1 of 2, 1 claimed wrongly" in flat(mixed)


def test_a_row_per_robot_says_what_it_did() -> None:
    robots = (
        RobotSummary("r1", OBJECTS[:1], 25.2, 112.4, 0),
        RobotSummary("r2", OBJECTS[1:], 22.0, 90.0, None),
    )
    text = printed(DemoSummary(NAMES, OBJECTS, 210.0, 202.4, 7.4, robots=robots, closest_m=1.26))
    rows = {line.split()[0]: line.split() for line in text.splitlines() if " r" in line[:3]}
    assert rows["r1"] == ["r1", "refrigerator", "25.2", "m", "112", "s", "0"]
    assert rows["r2"] == ["r2", "nothing", "22.0", "m", "90", "s", "-"]
    assert "Closest to each other: 1.3 m" in flat(text)
    assert "Closest" not in printed(DemoSummary(NAMES, OBJECTS, 210.0, 202.4, 7.4))


def flat(text: str) -> str:
    return " ".join(text.split())


CELL_M = 0.1
FOUND = ObjectSummary("bed", "found", "seen", (4.5, 1.0, 0.4), 30.0, 8.0, 7.0, 0.5, 0.0)
WRONG = ObjectSummary("sofa", "found", "seen", (4.5, 1.0, 0.4), 30.0, 8.0, 7.0, 9.0, 9.0)
MISSED = ObjectSummary("toilet", "not_found", "not seen", (), 60.0, 14.0, 1.0, 1.0, 1.0)


@pytest.fixture
def view() -> SearchView:
    """6 x 4 m of free floor."""
    free = np.full((60, 40), Occupancy.FREE, np.uint8)
    nothing = np.zeros((0, 0), np.float32)
    grid = GridSpec(CELL_M, (0, 0), free.shape)
    return SearchView("", 1, 1, 1, grid, free, np.zeros_like(free), nothing)


def drawn(
    path: Path,
    view: SearchView,
    *,
    trail_m: tuple[tuple[float, float], ...] = (),
    others: tuple[DrivenPath, ...] = (),
    objects: tuple[ObjectSummary, ...] = (),
) -> U8:
    write_picture(path, view, [DrivenPath(trail_m, 0.5), *others], objects)
    image = cv2.imread(str(path))
    assert image is not None
    return image.astype(np.uint8)


def test_the_paths_of_all_robots_are_drawn(view: SearchView, tmp_path: Path) -> None:
    first = ((0.5, 3.0), (3.0, 3.0))
    one = drawn(tmp_path / "one.png", view, trail_m=first)
    other = DrivenPath(((0.5, 1.0), (3.0, 1.0)), 0.5)
    both = drawn(tmp_path / "both.png", view, trail_m=first, others=(other,))
    rows, columns = np.nonzero(np.any(one != both, axis=-1))
    assert np.ptp(columns) > 2.5 / CELL_M * MIN_PIXELS_PER_CELL
    assert rows.min() > one.shape[0] / 2  # 1 m of 4 m is in the lower half; the first one stays


def test_only_claims_with_a_position_are_drawn(view: SearchView, tmp_path: Path) -> None:
    plain = drawn(tmp_path / "plain.png", view)
    found = drawn(tmp_path / "found.png", view, objects=(FOUND,))
    wrong = drawn(tmp_path / "wrong.png", view, objects=(WRONG,))
    missed = drawn(tmp_path / "missed.png", view, objects=(MISSED,))
    assert np.any(found != plain)
    assert np.any(wrong != found)
    assert np.array_equal(missed, plain)
