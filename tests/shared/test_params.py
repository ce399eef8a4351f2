"""Parameters are immutable and checked; former names of fields lead to present ones."""

from __future__ import annotations

import importlib
import importlib.util
from importlib.metadata import metadata
from pathlib import Path

import pytest
from pydantic import Field, SecretStr, ValidationError

from onemap_shared.params import Params, is_secret, masked
from onemap_shared.services import (
    ALL,
    doubled,
    doubled_sentence,
)


class Sample(Params):
    """Parameters of a test."""

    size_m: float = Field(default=1.0, gt=0)


def declared() -> list[type[Params]]:
    """The parameter models that services' configurations compose, without their bases."""
    for service in ALL:
        importlib.import_module(f"{service.module}.config")
    found, left = [], [Params]
    while left:
        children = left.pop().__subclasses__()
        found += [child for child in children if child.__module__.startswith("onemap_")]
        left += children
    return [kind for kind in found if not kind.__subclasses__()]


@pytest.mark.parametrize(
    "values", [{"size": 1.0}, {"size_m": float("nan")}, {"size_m": float("inf")}, {"size_m": 0}]
)
def test_unknown_keys_and_numbers_out_of_range_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        Sample.model_validate(values)


def test_a_former_name_leads_to_a_field_and_is_none() -> None:
    renamed = {kind: kind.former_keys for kind in declared() if kind.former_keys}
    for kind, names in renamed.items():
        assert set(names.values()) <= set(kind.model_fields), kind
        assert set(names).isdisjoint(kind.model_fields), kind


def test_every_field_has_a_default_that_fits_and_a_description() -> None:
    for kind in declared():
        for name, field in kind.model_fields.items():
            assert field.description, f"{kind.__name__}.{name}"
        if not any(field.is_required() for field in kind.model_fields.values()):
            assert kind.model_validate(kind().model_dump()) == kind()


def test_a_secret_is_known_by_its_name() -> None:
    """The name alone decides how the environment is read and what an error shows."""
    fields = [(name, f.annotation) for kind in declared() for name, f in kind.model_fields.items()]
    secrets = {name for name, annotation in fields if annotation is SecretStr}
    assert secrets
    assert secrets == {name for name, _ in fields if is_secret(name)}


def test_secrets_are_masked_at_any_depth() -> None:
    assert masked({"a": [{"look_token": "hunter2", "b": 1}], "token": "hunter2"}) == {
        "a": [{"look_token": "***", "b": 1}],
        "token": "***",
    }


ROOT = Path(__file__).parents[2]


def test_every_service_has_a_module_to_run_and_an_extra_that_installs_it() -> None:
    extras = metadata("onemap").get_all("Provides-Extra") or []
    for service in ALL:
        assert importlib.util.find_spec(f"{service.module}.__main__"), service
        assert service.extra in extras, service


def test_every_service_folder_is_listed() -> None:
    packages = {path.name for path in (ROOT / "services").glob("*/onemap_*")}
    assert packages == {service.module.split(".")[0] for service in ALL}


def test_two_processes_of_one_role_are_named() -> None:
    members = {("planner", "a"), ("mapper", "b"), ("gateway", "c"), ("gateway", "d"), ("up", "e")}
    assert doubled(members) == {}
    twice = doubled({*members, ("planner", "f"), ("simulator", "g"), ("robot", "h")})
    assert twice == {"robot": ("robot h", "simulator g"), "planner": ("planner a", "planner f")}
    assert doubled_sentence("robot", twice["robot"]) == (
        "2 processes are the robot (robot h, simulator g): their messages mix"
    )
