"""Each error of the benchmark changes the simulator's settings, and only those of its kind."""

from __future__ import annotations

import pytest

from onemap_simulator.config import SimulatorConfig
from onemap_tools.bench.navigation.choices import Errors
from onemap_tools.bench.navigation.errors import with_errors

PLAIN = SimulatorConfig(seed=4)
SECTIONS = {
    Errors.NONE: set(),
    Errors.DRIFT: {"odometry_drift"},
    Errors.JUMP: {"odometry_drift", "loop_closure"},
    Errors.LATE: {"frame_link"},
    Errors.DROPPED: {"frame_link"},
    Errors.DEPTH: {"camera"},
    Errors.PEOPLE: {"people"},
    Errors.ALL: {"odometry_drift", "loop_closure", "frame_link", "camera", "people"},
}


@pytest.mark.parametrize("errors", Errors)
def test_an_error_changes_its_own_section(errors: Errors) -> None:
    changed = with_errors(PLAIN, errors)
    names = type(PLAIN).model_fields
    differing = {name for name in names if getattr(changed, name) != getattr(PLAIN, name)}
    assert differing == SECTIONS[errors]


def test_what_an_error_does_not_name_stays_as_configured() -> None:
    camera = PLAIN.camera.model_copy(update={"width": 64})
    config = PLAIN.model_copy(update={"camera": camera})
    changed = with_errors(config, Errors.ALL)
    assert changed.camera.width == 64
    assert (changed.frame_link.max_delay_s, changed.frame_link.lost_share) == (0.6, 0.2)
