"""Models of the sections, and their schema."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from onemap_shared.config import SECTIONS
from onemap_tools.cli.config_report import SectionModels, check, effective, installed_models, select
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError


def models_of(annotation: Any) -> Iterator[type[BaseModel]]:
    """Every model that is named in a field's type."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from models_of(part)


def all_models() -> dict[str, type[BaseModel]]:
    """Every model of the configuration, by name, those below the sections too."""
    found: dict[str, type[BaseModel]] = {}
    waiting: list[type[BaseModel]] = list(installed_models().known.values())
    while waiting:
        model = waiting.pop()
        if model.__name__ not in found:
            # Bases hold fields that others inherit.
            bases = [b for b in model.__mro__ if issubclass(b, BaseModel) and b.model_fields]
            found.update({base.__name__: base for base in bases})
            for field in model.model_fields.values():
                waiting.extend(models_of(field.annotation))
    return found


def test_every_section_has_a_model() -> None:
    models = installed_models()
    assert models.missing == {}
    assert tuple(models.known) == SECTIONS
    assert {"CocoParams", "BoxDetectorParams", "RadioParams", "RecoveryParams"} <= set(all_models())


@pytest.mark.parametrize("name", sorted(all_models()))
def test_every_key_has_a_description(name: str) -> None:
    fields = all_models()[name].model_fields
    assert [key for key, field in fields.items() if not (field.description or "").strip()] == []


def test_a_section_is_selected_by_its_name() -> None:
    models = installed_models()
    assert select("", models) is models
    assert list(select("mapper", models).known) == ["mapper"]
    missing = SectionModels({}, {"mapper": "The mapper needs the package 'torch'."})
    with pytest.raises(CliError, match="needs the package 'torch'"):
        select("mapper", missing)
    with pytest.raises(CliError, match="no section 'maper'"):
        select("maper", models)


def test_only_the_robots_of_the_file_take_effect(tmp_path: Path) -> None:
    models = installed_models()
    assert set(effective(None, models)) == set(SECTIONS) - {"replay", "ros2"}
    config = tmp_path / "robot.yaml"
    config.write_text("log: {level: debug}\n")
    assert set(effective(config, models)) == set(SECTIONS) - {"simulator", "replay", "ros2"}


def test_two_robots_are_a_mistake(tmp_path: Path) -> None:
    config = tmp_path / "robot.yaml"
    config.write_text(f"simulator: {{}}\nreplay: {{directory: {tmp_path}}}\n")
    with pytest.raises(CliError, match="both robots") as error:
        check(config, installed_models())
    assert error.value.exit_code == EXIT_USAGE_ERROR
    assert error.value.document["ok"] is False
