"""Configuration: one YAML file per deployment, one section per service.

A service reads its own section and the common ones, ``bus`` and ``log``. An
unknown key is refused with the file or variable that has it, its path and what
to do. Environment variables ``ONEMAP__SECTION__KEY=value`` (value in YAML, a
secret as it is) override the file. No error shows a secret.
"""
# Talks: reads files and the environment.
# Touches files: the configuration.

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

import yaml
from pydantic import BaseModel, Field, ValidationError

from onemap_shared.keys import NAMESPACE
from onemap_shared.params import Params, is_secret, masked
from onemap_shared.services import SERVICES

S = TypeVar("S", bound=BaseModel)

PREFIX = "ONEMAP__"
MAX_SHOWN_CHARS = 200  # of a wrong value
NEAR = 0.6  # likeness of a name to one that is meant
# What PyYAML raises; ValueError of a date, a number or a character that there is not.
UNREADABLE = (yaml.YAMLError, ValueError, RecursionError)
SECTIONS = ("bus", "log", *SERVICES)
NO_SETTING = "remove it, since 'onemap config schema' lists all settings"


class _Loader(yaml.SafeLoader):
    """YAML in which no key stands twice: the first would be lost without a word."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        before: set[str] = set()
        for key, _ in node.value:
            name = str(key.value)
            if name in before:
                raise yaml.MarkedYAMLError(None, None, "a key stands twice", key.start_mark)
            before.add(name)
        return super().construct_mapping(node, deep)


class ConfigError(Exception):
    """A configuration that cannot be used; the text says where and what to write instead."""


class Sections(dict[str, dict[str, Any]]):
    """The sections of a configuration, and where they come from.

    source: the file, as it was named. variables: those of the environment that override it.
    """

    def __init__(self, content: Mapping[str, Any], source: str) -> None:
        super().__init__({name: dict(section or {}) for name, section in content.items()})
        self.source = source
        self.variables: list[str] = []

    def origin(self, path: str) -> str:
        """The file or the variable that sets the key ``path``."""
        variable = PREFIX + path.replace(".", "__").upper()
        given = [each for each in self.variables if f"{variable}__".startswith(f"{each}__")]
        return given[0] if given else self.source


Endpoint = Annotated[str, Field(pattern=r"^(tcp|tls|quic|unixsock-stream)/.+$")]


class LinkParams(Params):
    """How this process sends frames and fields; receivers need no setting."""

    compression: Literal["none", "lossless", "lossy"] = Field(
        default="none",
        description="Of frames and fields. none: on loopback or a wired network the time for it "
        "is lost. lossless changes no value. lossy: colour as JPEG, which needs OpenCV at both "
        "ends, features and variances in 8 bits; a frame takes a fifth of its bytes, a field a "
        "quarter. Depth never loses anything.",
    )
    window: int = Field(
        default=0,
        ge=0,
        le=16,
        description="Frames, and fields, that may be under way without the receiver's receipt; "
        "the newest waits for one and replaces older ones, so that no queue grows on a slow link. "
        "1 keeps them freshest, 2 uses a link with a long delay better; 0: no limit.",
    )


class BusConfig(Params):
    """Where the router is."""

    connect: tuple[Endpoint, ...] = Field(
        default=("tcp/127.0.0.1:7447",),
        min_length=1,
        description="Zenoh endpoints of the router; loopback, because nothing is open by default.",
    )
    namespace: str = Field(
        default="",
        pattern=rf"^$|{NAMESPACE}",
        description="Prefix of all keys, one per robot of a fleet, for example fleet/r1.",
    )
    link: LinkParams = Field(
        default=LinkParams(), description="Compression and pace of frames and fields."
    )


class LogConfig(Params):
    """How a process logs."""

    format: Literal["human", "json"] = Field(
        default="human", description="json: an object a line, for log collectors."
    )
    level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="info names every change of state and no single frame."
    )


def read(
    path: Path | None,
    environment: Mapping[str, str] = os.environ,
    wrong: list[str] | None = None,
) -> Sections:
    """All sections of the file (none if ``path`` is None) with the overrides applied.

    wrong: takes a sentence for each section that is none, and these are left out; without it they
    raise ConfigError, as everything else that cannot be read.
    """
    document: Any = {}
    if path is not None:
        try:
            document = yaml.load(path.read_text(encoding="utf-8"), _Loader) or {}
        except OSError as problem:
            reason = problem.strerror or problem
            raise ConfigError(f"cannot read configuration {path}: {reason}") from problem
        except UNREADABLE as problem:
            raise ConfigError(f"{path} is not valid YAML{_place(problem)}") from None
    source = str(path) if path is not None else "configuration"
    if not isinstance(document, dict):
        raise ConfigError(f"{source} must be a mapping of sections, not {type(document).__name__}")
    found = {name: _section_problem(name, section) for name, section in document.items()}
    problems = [f"{source}: {problem}" for problem in found.values() if problem]
    if problems and wrong is None:
        raise ConfigError("; ".join(problems))
    if wrong is not None:
        wrong += problems
    sections = Sections({n: each for n, each in document.items() if not found[n]}, source)
    _override(sections, environment)
    return sections


def _section_problem(name: object, section: object) -> str:
    if name not in SECTIONS:
        return f"section {name!r} is unknown; {_nearest(name, SECTIONS)}"
    if section is not None and not isinstance(section, dict):
        return f"section {name!r} must be a mapping"
    return ""


def _override(sections: Sections, environment: Mapping[str, str]) -> None:
    for variable, text in sorted(environment.items()):
        if not variable.startswith(PREFIX):
            continue
        parts = [part.lower() for part in variable[len(PREFIX) :].split("__")]
        if len(parts) < 2 or not all(parts):
            raise ConfigError(f"{variable} must be {PREFIX}SECTION__KEY")
        if problem := _section_problem(parts[0], None):
            raise ConfigError(f"{variable}: {problem}")
        value = text if is_secret(parts[-1]) else _parsed(variable, text)
        place: Any = sections.setdefault(parts[0], {})
        for part in parts[1:-1]:
            place = place.setdefault(part, {})
            if not isinstance(place, dict):
                raise ConfigError(f"{variable}: {part!r} is a value, not a section")
        place[parts[-1]] = value
        sections.variables.append(PREFIX + "__".join(parts).upper())


def _parsed(variable: str, text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except UNREADABLE as problem:
        raise ConfigError(f"{variable}: the value is not valid YAML{_place(problem)}") from None


def _place(problem: Exception) -> str:
    """Where a text is no YAML, and the rule; never the text itself, which may hold a secret."""
    if isinstance(problem, yaml.MarkedYAMLError) and problem.problem_mark is not None:
        mark = problem.problem_mark
        reason = re.sub(r"'[^']{3,}'", "...", problem.problem or "it cannot be read")
        return f" (line {mark.line + 1}, column {mark.column + 1}): {reason}"
    if isinstance(problem, UnicodeDecodeError):
        return f": {problem.reason}"
    if isinstance(problem, RecursionError):
        return ": it is nested too deeply"
    return ": a date or a number in it cannot be read" if isinstance(problem, ValueError) else ""


def _nearest(name: object, valid: Sequence[str]) -> str:
    near = difflib.get_close_matches(str(name), valid, n=1, cutoff=NEAR)
    return f"did you mean {near[0]!r}?" if near else f"valid are {', '.join(valid)}"


def section(sections: Mapping[str, Any], name: str, model: type[S]) -> S:
    """The section ``name`` as ``model``, or ConfigError with the path of what is wrong."""
    if wrong := mistakes(sections, name, model):
        raise ConfigError("; ".join(wrong))
    return model.model_validate(sections.get(name, {}))


def mistakes(sections: Mapping[str, Any], name: str, model: type[BaseModel]) -> list[str]:
    """Every mistake of the section ``name``, one sentence each; empty if it fits ``model``."""
    try:
        model.model_validate(sections.get(name, {}))
    except ValidationError as problem:
        return _sentences(problem, name, model, sections)
    return []


def _sentences(
    problem: ValidationError, name: str, model: type[BaseModel], sections: Mapping[str, Any]
) -> list[str]:
    sentences = []
    for error in problem.errors():
        place = error["loc"]
        names, owners = _follow(model, place[:-1])
        path = ".".join([name, *names, *(str(part) for part in place[-1:])])
        where = f"{sections.origin(path)}: {path}" if isinstance(sections, Sections) else path
        if error["type"] == "extra_forbidden":
            sentences.append(f"{where} {_unknown_key(str(place[-1]), owners)}")
        else:
            secret = any(is_secret(str(part)) for part in place)
            got = "a secret" if secret else repr(masked(error["input"]))[:MAX_SHOWN_CHARS]
            sentences.append(f"{where}: {error['msg']} (got {got})")
    return sentences


def _unknown_key(key: str, owners: Sequence[type[BaseModel]]) -> str:
    """The error about a key that none of the models has: its new name, or the nearest one."""
    for owner in owners:
        if issubclass(owner, Params) and key in owner.former_keys:
            return f"is now called {owner.former_keys[key]!r}: rename it"
    valid = [field for owner in owners for field in owner.model_fields]
    near = difflib.get_close_matches(key, valid, n=1, cutoff=NEAR)
    hint = f"did you mean {near[0]!r}? If not" if near else f"there are {', '.join(valid)}"
    return f"is unknown; {hint}: {NO_SETTING}"


def _follow(
    model: type[BaseModel], place: tuple[int | str, ...]
) -> tuple[list[str], list[type[BaseModel]]]:
    """The path as it is written in the file, and the models whose fields are valid at its end.

    Where a section is one of several models, pydantic's path also holds the chosen one's tag,
    which stands in no file.
    """
    written, here = [], [model]
    for part in place:
        chosen = [member for member in here if len(here) > 1 and _has_tag(member, str(part))]
        if chosen:
            here = chosen
            continue
        written.append(str(part))
        fields = [m.model_fields[str(part)] for m in here if str(part) in m.model_fields]
        options = [kind for f in fields for kind in get_args(f.annotation) or (f.annotation,)]
        here = [kind for kind in options if isinstance(kind, type) and issubclass(kind, BaseModel)]
    return written, here


def _has_tag(model: type[BaseModel], tag: str) -> bool:
    return any(tag in get_args(field.annotation) for field in model.model_fields.values())


def load(path: Path | None, name: str, model: type[S]) -> tuple[BusConfig, LogConfig, S]:
    """What one service needs: bus, log and its own section. Raises ConfigError."""
    sections = read(path)
    return (
        section(sections, "bus", BusConfig),
        section(sections, "log", LogConfig),
        section(sections, name, model),
    )
