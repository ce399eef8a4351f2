"""The errors of a real robot that the benchmark offers: changes of the simulator's settings."""

from __future__ import annotations

from typing import Any

from onemap_simulator.config import SimulatorConfig
from onemap_tools.bench.navigation.choices import Errors
from onemap_tools.bench.navigation.methods import merged

DRIFT = {"odometry_drift": {"way_percent": 2.0, "yaw_deg_per_m": 0.5}}
JUMP = {**DRIFT, "loop_closure": {"radius_m": 1.0}}
LATE = {"frame_link": {"min_delay_s": 0.1, "max_delay_s": 0.6}}
DROPPED = {"frame_link": {"lost_share": 0.2, "lost_in_a_row": 4.0}}
DEPTH = {
    "camera": {
        "depth_noise_m": 0.002,
        "depth_errors": {
            "step_m": 0.0028,
            "edge_flying": 0.3,
            "edge_holes": 0.3,
            "dark_below": 25.0,
            "glass": True,
        },
    }
}
PEOPLE = {"people": {"count": 2}}

CHANGES: dict[Errors, tuple[dict[str, Any], ...]] = {
    Errors.NONE: (),
    Errors.DRIFT: (DRIFT,),
    Errors.JUMP: (JUMP,),
    Errors.LATE: (LATE,),
    Errors.DROPPED: (DROPPED,),
    Errors.DEPTH: (DEPTH,),
    Errors.PEOPLE: (PEOPLE,),
    Errors.ALL: (JUMP, LATE, DROPPED, DEPTH, PEOPLE),
}


def with_errors(config: SimulatorConfig, errors: Errors) -> SimulatorConfig:
    """The simulator's settings with these errors in place of what they say of the same."""
    document = config.model_dump()
    for changes in CHANGES[errors]:
        document = merged(document, changes)
    return SimulatorConfig.model_validate(document)
