"""Configurations: sections, mistakes and secrets; what parameters and services declare."""

from __future__ import annotations

import importlib
import importlib.util
import traceback
from importlib.metadata import metadata
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import pytest
from pydantic import Field, SecretStr, model_validator

from onemap_shared.config import BusConfig, ConfigError, load, mistakes, read, section
from onemap_shared.params import Params, is_secret, masked
from onemap_shared.services import ALL, doubled, doubled_sentence


class Inner(Params):
    depth_factor: float = 0.01


class Sample(Params):
    former_keys: ClassVar[dict[str, str]] = {"merge": "fusion"}

    cell_size_m: float = Field(default=0.1, gt=0)
    fusion: Inner = Inner()


class Near(Params):
    kind: Literal["near"] = "near"
    depth_m: float = 1.0
    inner: Inner = Inner()


class Far(Params):
    kind: Literal["far"]
    height_m: float = 2.0


class Choice(Params):
    """A section that is one of several models."""

    sensor: Annotated[Near | Far, Field(discriminator="kind")] = Near()


def write(path: Path, text: str) -> Path:
    file = path / "onemap.yaml"
    file.write_text(text, encoding="utf-8")
    return file


BAD_FILES = {
    "unknown section": ("maper: {}", "section 'maper' is unknown; did you mean 'mapper'"),
    "far from any": ("zzz: {}", "valid are bus, log"),
    "not a mapping": ("- 1", "must be a mapping of sections, not list"),
    "section is a value": ("mapper: 3", "section 'mapper' must be a mapping"),
    "not yaml": ("mapper: {", "not valid YAML"),
    "twice": ("log: {}\nmapper: {}\nlog: {}", r"not valid YAML \(line 3, column 1\): a key stands"),
    "twice below": ("log: {level: info, level: debug}", r"column 20\): a key stands twice"),
    "no date": (
        "mapper: {a: 2001-13-45}",
        "not valid YAML: a date or a number in it cannot be read",
    ),
    "too deep": ("mapper: " + "[" * 1000, "not valid YAML: it is nested too deeply"),
    "unknown key": (
        "mapper: {cell_size: 0.1}",
        "mapper.cell_size is unknown; did you mean 'cell_size_m'",
    ),
    "out of range": ("mapper: {cell_size_m: -1}", "mapper.cell_size_m: .* greater than 0"),
    "not a number": ("mapper: {cell_size_m: .nan}", "mapper.cell_size_m"),
    "no end": ("mapper: {cell_size_m: .inf}", "mapper.cell_size_m"),
    "bad endpoint": ("bus: {connect: ['127.0.0.1:7447']}", "bus.connect.0"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_mistakes_are_named_with_their_path(case: str, tmp_path: Path) -> None:
    text, reason = BAD_FILES[case]
    with pytest.raises(ConfigError, match=reason):
        load(write(tmp_path, text), "mapper", Sample)


def test_an_unknown_key_is_refused_with_its_origin_and_what_to_do(tmp_path: Path) -> None:
    file = write(tmp_path, "mapper: {max_weight: 3}")
    variable = "ONEMAP__MAPPER__FUSION"
    found = mistakes(read(file, {variable: "{decay: 1}"}), "mapper", Sample)
    reason = "remove it, since 'onemap config schema' lists"
    assert found[1].startswith(f"{file}: mapper.max_weight is unknown; there are cell_size_m, ")
    assert found[0].startswith(f"{variable}: mapper.fusion.decay is unknown; ")
    assert all(reason in sentence and "remove it" in sentence for sentence in found)


def test_a_missing_file_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"cannot read configuration .*: No such file"):
        read(tmp_path / "absent.yaml", {})


def test_the_environment_overrides_the_file(tmp_path: Path) -> None:
    file = write(tmp_path, "mapper: {cell_size_m: 0.1}")
    environment = {
        "ONEMAP__MAPPER__CELL_SIZE_M": "0.2",
        "ONEMAP__MAPPER__FUSION__DEPTH_FACTOR": "0.5",
        "ONEMAP__BUS__CONNECT": "[tcp/router:7447]",
        "PATH": "/bin",
    }
    sections = read(file, environment)
    assert section(sections, "mapper", Sample) == Sample(
        cell_size_m=0.2, fusion=Inner(depth_factor=0.5)
    )
    assert section(sections, "bus", BusConfig).connect == ("tcp/router:7447",)


@pytest.mark.parametrize(
    ("variable", "value", "reason"),
    [
        ("ONEMAP__MAPER__X", "1", "did you mean 'mapper'"),
        ("ONEMAP__MAPPER", "1", "must be ONEMAP__SECTION__KEY"),
        ("ONEMAP__MAPPER__A__B", "1", "'a' is a value"),
        ("ONEMAP__MAPPER__X", "2001-13-45", "not valid YAML"),
    ],
)
def test_mistakes_in_the_environment_are_named(
    variable: str, value: str, reason: str, tmp_path: Path
) -> None:
    file = write(tmp_path, "mapper: {a: 1}")
    with pytest.raises(ConfigError, match=reason):
        read(file, {variable: value})


@pytest.mark.parametrize(
    ("sensor", "sentence"),
    [
        ({"kind": "near", "dept_m": 1}, r"mapper\.sensor\.dept_m is unknown; .*'depth_m'"),
        ({"kind": "far", "depth_m": 1}, r"mapper\.sensor\.depth_m is unknown; .*height_m"),
        ({"kind": "far", "height_m": "tall"}, r"mapper\.sensor\.height_m: .*\(got 'tall'\)"),
        (
            {"kind": "near", "inner": {"depth_facto": 1}},
            r"mapper\.sensor\.inner\.depth_facto is unknown; did you mean 'depth_factor'\?",
        ),
        ({"kind": "wide"}, r"mapper\.sensor: .*'near', 'far'"),
    ],
)
def test_one_of_several_models_is_named_as_in_the_file(
    sensor: dict[str, object], sentence: str
) -> None:
    with pytest.raises(ConfigError, match=sentence) as told:
        section({"mapper": {"sensor": sensor}}, "mapper", Choice)
    assert "sensor.near" not in str(told.value)
    assert "sensor.far" not in str(told.value)


def test_a_key_of_an_earlier_release_is_refused_with_its_new_name(tmp_path: Path) -> None:
    file = write(tmp_path, "mapper: {merge: 1}")
    with pytest.raises(ConfigError, match=r"mapper\.merge is now called 'fusion': rename it"):
        load(file, "mapper", Sample)


class Locked(Params):
    token: SecretStr = SecretStr("")

    @model_validator(mode="after")
    def _refused(self) -> Locked:
        raise ValueError("never fits")


@pytest.mark.parametrize("secret", ["0123", "a: b", "#5", " s ", "{"])
def test_a_secret_of_the_environment_is_taken_as_it_is(secret: str) -> None:
    assert read(None, {"ONEMAP__GATEWAY__TOKEN": secret}) == {"gateway": {"token": secret}}


@pytest.mark.parametrize(
    "text",
    [
        "gateway: {token: 'hunter2",
        "gateway: {token: *hunter2}",
        "gateway: {token: !hunter2 x}",
        "gateway: {token: hunter2}",
        "gateway: {token: [hunter2]}",
    ],
)
def test_no_error_shows_a_secret(text: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as told:
        section(read(write(tmp_path, text), {}), "gateway", Locked)
    assert "hunter2" not in str(told.value)
    assert "hunter2" not in "".join(traceback.format_exception(told.value))


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
        "2 processes run as the robot (robot h, simulator g): their messages mix"
    )
