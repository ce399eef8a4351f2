"""The text of a JSON schema: every key with type, limits, default and reason."""

from __future__ import annotations

from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, Field

from onemap_tools.cli.config_report import SectionModels, installed_models, schema
from onemap_tools.cli.schema_text import SchemaText


class Cat(BaseModel):
    """A cat."""

    kind: Literal["cat"] = Field(default="cat", description="Which animal.")
    lives: int = Field(default=9, ge=1, lt=10, description="How many are left.")


class Dog(BaseModel):
    """A ``good``
    dog."""

    kind: Literal["dog"] = Field(default="dog", description="Which animal.")
    names: list[str] = Field(default=[], description="What it listens to.")


class Home(BaseModel):
    """Who lives here."""

    pet: Annotated[Cat | Dog, Field(discriminator="kind", description="The animal.")] = Cat()
    door: Literal["open", "shut"] = Field(description="Of the house.")
    size_m: tuple[float, float] | None = Field(default=None, description="Width and depth.")


LINES = tuple(SchemaText(schema(SectionModels({"home": Home}, {}))).lines())  # type: ignore[dict-item]


@pytest.mark.parametrize(
    "line",
    [
        "home: Who lives here.",
        "home.pet: one of these, by kind",
        "    The animal.",
        "home.pet with kind cat: A cat.",
        "home.pet.lives: whole number >= 1 and < 10, default 9",
        "    How many are left.",
        "home.pet with kind dog: A good dog.",
        "home.pet.names: list of text, default []",
        'home.door: "open" or "shut", required',
        "home.size_m: [number, number] or none, default none",
    ],
)
def test_a_key_is_a_line(line: str) -> None:
    assert line in LINES


def test_sections_are_separated_by_an_empty_line() -> None:
    models = SectionModels({"home": Home, "cat": Cat}, {})  # type: ignore[dict-item]
    lines = list(SchemaText(schema(models)).lines())
    assert lines[lines.index("cat: A cat.") - 1] == ""


def test_every_key_of_the_configuration_is_listed() -> None:
    text = "\n".join(SchemaText(schema(installed_models())).lines())
    words = " ".join(text.split())
    for model in installed_models().known.values():
        for key, field in model.model_fields.items():
            assert f".{key}: " in text
            assert " ".join((field.description or "").split()) in words
    assert 'log.format: "human" or "json", default "human"' in text
    assert "mapper.cell_size_m: number > 0 and <= 1, default 0.1" in text
    assert "perception.encoder.model: text, required" in text
    assert "planner.drive.max_linear_mps: number > 0, default 0.7" in text
    assert "perception.detector with backend coco: " in text
