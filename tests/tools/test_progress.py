"""The display of a running search."""

from __future__ import annotations

import io
from dataclasses import replace

from rich.console import Console

from onemap_tools.progress import (
    LINE_EVERY_S,
    LineView,
    LiveView,
    MapUpdates,
    SearchProgress,
    panel,
    progress_view,
)

PROGRESS = SearchProgress(
    elapsed_s=12.0,
    objects=("sofa", "bed"),
    done=(("sofa", "found"),),
    target="bed",
    state="exploring",
    reason="walking to a frontier",
    path_length_m=3.25,
    position_m=(1.0, -2.0),
    map=MapUpdates(0.2, 5.0),
)


def console(*, terminal: bool = False) -> Console:
    return Console(file=io.StringIO(), force_terminal=terminal, width=200)


def text_of(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_line_shows_all_values() -> None:
    out = console()
    with LineView(out) as view:
        view.show(PROGRESS)
    (line,) = text_of(out).splitlines()
    for part in ("[1/2]", "bed: exploring", "(1.0, -2.0) m, drove 3.2 m", "0.2 s old", "5.0 upd"):
        assert part in line


def test_a_line_comes_at_a_change_and_every_five_seconds() -> None:
    out = console()
    with LineView(out) as view:
        for elapsed_s in (0.0, 1.0, LINE_EVERY_S + 0.1, LINE_EVERY_S + 0.2):
            view.wait(elapsed_s, "no frame")
        view.wait(LINE_EVERY_S + 0.3, "no map")
    assert len(text_of(out).splitlines()) == 3


def test_each_robot_has_lines_of_its_own() -> None:
    out = console()
    with LineView(out) as view:
        for name in ("r1", "r2", "r1", "r2"):
            view.show(replace(PROGRESS, name=name))
    lines = text_of(out).splitlines()
    assert [line.split()[2] for line in lines] == ["r1", "r2"]


def test_unknown_values_are_left_out() -> None:
    unknown = SearchProgress(1.0, ("sofa",), (), "sofa", "exploring", "", 0.0)
    assert unknown.robot == "drove 0.0 m"
    assert str(unknown.map) == ""
    out = console()
    with LineView(out) as view:
        view.show(unknown)
    out.print(panel(unknown))
    assert "map" not in text_of(out)


def test_a_terminal_gets_the_live_panel() -> None:
    terminal = console(terminal=True)
    assert isinstance(progress_view(terminal), LiveView)
    assert isinstance(progress_view(console()), LineView)
    with progress_view(terminal) as view:
        view.wait(1.0, "waiting [for] the robot")
        view.show(PROGRESS)
    assert "exploring" in text_of(terminal)


def test_a_drive_has_no_row_of_objects() -> None:
    drive = replace(PROGRESS, objects=(), done=(), target="", state="approaching")
    out = console()
    out.print(panel(drive))
    assert "approaching: walking to a frontier" in text_of(out)
    assert "objects" not in text_of(out)
