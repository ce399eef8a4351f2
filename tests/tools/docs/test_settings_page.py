"""The page of settings: each key with its variable, type, default and reason."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, Field

from onemap_shared.config import read
from onemap_tools.cli.config_report import SectionModels, installed_models, schema
from onemap_tools.docs.settings_page import settings_page


class Tram(BaseModel):
    """Runs on rails."""

    kind: Literal["tram"] = Field(default="tram", description="Which one.")
    depot: Path = Field(default=Path("/here/depot"), description="Where a|b is < c * d.")


class Bus(BaseModel):
    """Runs on roads."""

    kind: Literal["bus"] = Field(default="bus", description="Which one.")
    seats: int = Field(ge=1, description="For sitting.")


class Line(BaseModel):
    """How one travels."""

    car: Annotated[Tram | Bus, Field(discriminator="kind", description="It.")] = Tram()
    night: str | None = Field(default=None, description="Its name at night.")


PAGE = settings_page(schema(SectionModels({"line": Line}, {})), Path("/here"))  # type: ignore[dict-item]


@pytest.mark.parametrize(
    "line",
    [
        "## line",
        "How one travels.",
        "| `line.car` | one of these, by kind |  | It. |",
        "| **`line.car with kind tram`** |  |  | Runs on rails. |",
        "| `line.car.seats`<br>`ONEMAP__LINE__CAR__SEATS` | whole number >= 1 | required "
        "| For sitting. |",
        '| `line.car.depot`<br>`ONEMAP__LINE__CAR__DEPOT` | path | `"depot"` '
        "| Where a\\|b is &lt; c \\* d. |",
        "| `line.night`<br>`ONEMAP__LINE__NIGHT` | text or none | none | Its name at night. |",
    ],
)
def test_a_key_is_a_row(line: str) -> None:
    assert line in PAGE.splitlines()


def test_every_key_of_the_configuration_is_listed() -> None:
    models = installed_models()
    page = settings_page(schema(models), Path("/nowhere"))
    for name, model in models.known.items():
        for key in model.model_fields:
            assert f"`{name}.{key}`" in page


def test_a_variable_of_the_page_overrides_its_key() -> None:
    assert "`mapper.cell_size_m`<br>`ONEMAP__MAPPER__CELL_SIZE_M`" in settings_page(
        schema(installed_models()), Path("/nowhere")
    )
    sections = read(None, {"ONEMAP__MAPPER__CELL_SIZE_M": "0.05"})
    assert sections == {"mapper": {"cell_size_m": 0.05}}
