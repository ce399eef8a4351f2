"""Describes a past search, step by step, as the gateway tells it."""

from __future__ import annotations

from collections.abc import Iterator

from rich.text import Text

from onemap import ReplayStep, SearchReplay


def describe_replay(replay: SearchReplay) -> Iterator[Text]:
    """The lines of each step, then how many steps are left out."""
    for number, step in enumerate(replay.steps, 1):
        yield Text(_head(step, number, len(replay.steps)), style="bold")
        yield Text(f"{step.target or replay.search.subject}: {step.state}: {step.reason}")
        if step.goal_m is not None:
            kind = step.goal_kind.replace("_", " ")
            yield Text(f"Goal: {kind} at ({_place(step.goal_m)}).")
    if replay.left_out:
        yield Text(f"{replay.left_out} steps are left out.")


def _head(step: ReplayStep, number: int, count: int) -> str:
    robot = "" if step.robot_m is None else f", robot at ({_place(step.robot_m)})"
    return f"Step {number} of {count}, after {step.elapsed_s:.1f} s{robot}"


def _place(xy: tuple[float, float]) -> str:
    return f"{xy[0]:.1f}, {xy[1]:.1f}"
