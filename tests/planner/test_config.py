"""The section ``planner``: former keys are named, nonsense is refused."""

import pytest
from pydantic import ValidationError

from onemap_planner.config import PlannerConfig
from onemap_shared.config import ConfigError, section


@pytest.mark.parametrize(
    "planner", [{"drive": {"max_linear_mps": -1.0}}, {"plan_hz": 0}, {"colour": "red"}]
)
def test_nonsense_is_refused(planner: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        PlannerConfig.model_validate(planner)


@pytest.mark.parametrize(
    ("planner", "new"),
    [
        ({"terrain": {"radius_m": 0.3}}, "costmap"),
        ({"freshness": {}}, "staleness"),
        ({"costmap": {"comfort_m": 0.5}}, "inflation_radius_m"),
        ({"goal": {"keep_margin": 0.2}}, "hysteresis"),
        ({"explore": {"shun_m": 0.5}}, "blacklist_radius_m"),
        ({"recovery": {"max_bumps": 3}}, "max_stuck_count"),
    ],
)
def test_a_former_key_is_refused_with_its_new_name(planner: dict[str, object], new: str) -> None:
    with pytest.raises(ConfigError, match=f"is now called '{new}'"):
        section({"planner": planner}, "planner", PlannerConfig)
