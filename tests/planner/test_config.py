"""The configuration and the plain rules name the same things."""

from dataclasses import fields

import pytest
from pydantic import ValidationError

from onemap_planner.config import PlannerConfig


def test_every_rule_comes_from_the_configuration() -> None:
    config = PlannerConfig()
    params = config.params()
    for group in fields(params):
        given = getattr(config, group.name).model_dump()
        taken = {field.name for field in fields(getattr(params, group.name))}
        assert set(given) <= taken
        assert taken - set(given) <= {"bumper_m"}  # follows from the robot's size


def test_every_default_is_explained() -> None:
    config = PlannerConfig()
    for name, field in PlannerConfig.model_fields.items():
        section = getattr(config, name)
        nested = getattr(type(section), "model_fields", None)
        assert field.description or nested
        for key, inner in (nested or {}).items():
            assert inner.description, f"{name}.{key}"


@pytest.mark.parametrize(
    "section", [{"drive": {"max_linear_mps": -1.0}}, {"plan_hz": 0}, {"colour": "red"}]
)
def test_nonsense_is_refused(section: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        PlannerConfig.model_validate(section)
