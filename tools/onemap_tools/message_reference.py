"""Every key and message of the code as Markdown, printed by ``-m`` of this module."""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
import typing
from collections.abc import Iterator, Sequence
from enum import Enum, IntEnum
from typing import Any

import numpy as np

from onemap_shared import keys, messages, wire
from onemap_shared.keys import Delivery, Procedure, Topic

# Without rotation, at x = 1.5 m, y = -2 m.
EXAMPLE = messages.Odometry(
    41,
    1_700_000_000_000_000_000,
    np.array([[1.0, 0, 0, 1.5], [0, 1, 0, -2], [0, 0, 1, 0], [0, 0, 0, 1]]),
    0.5,
    -0.25,
)
SERVICE = "<service>"
BYTES_PER_LINE = 16
SCALARS = {int: "integer", float: "number", str: "string", bool: "boolean", bytes: "bytes"}
ENTRY = re.compile(r"    (\w+): (.*)")  # of the section "Attributes:" of a docstring
SHAPE = re.compile(r"(\([^)]*\)) (.*)")  # that the description of an array begins with


def messages_reference() -> str:
    """Keys, an example on the wire, and every field of every message."""
    types = list(message_types())
    parts = _parts(types)
    _, common = docstring_parts(messages.__doc__ or "")
    lines = [*_keys(), *_example(), "## Fields", ""]
    for cls in types:
        lines += _message(cls, common)
    lines += ["## Values of several fields", ""]
    for cls in parts:
        if dataclasses.is_dataclass(cls):
            lines += _message(cls, common)
    lines += ["## Enumerations", ""]
    enumerations: list[type[Enum]] = [cls for cls in parts if issubclass(cls, Enum)]
    enumerations += [messages.Occupancy, messages.Layer]  # which arrays hold as numbers
    for kind in dict.fromkeys(enumerations):
        lines += _enum(kind)
    return "\n".join(lines).rstrip() + "\n"


def topics() -> list[Topic[Any]]:
    """Every topic, with the heartbeat of any service."""
    fixed = [value for value in vars(keys).values() if isinstance(value, Topic)]
    return [t for t in fixed if t is not keys.ALL_HEARTBEATS] + [keys.heartbeat(SERVICE)]


def message_types() -> Iterator[type]:
    """Every type that travels under a key, once, in the order of the keys."""
    listed = [topic.message for topic in topics()]
    listed += [cls for p in _procedures() for cls in (p.request, p.reply)]
    yield from dict.fromkeys(listed)


def docstring_parts(docstring: str) -> tuple[str, dict[str, str]]:
    """A docstring's text, and what its "Attributes:" say of each field, in one line each."""
    text, _, section = inspect.cleandoc(docstring).partition("Attributes:")
    fields: dict[str, str] = {}
    name = ""
    for line in section.splitlines():
        if entry := ENTRY.fullmatch(line):
            name = entry[1]
            fields[name] = entry[2]
        elif line.strip() and name:
            fields[name] += " " + line.strip()
    return text.strip(), fields


def _hex_dump(data: bytes) -> Iterator[str]:
    """Lines of offset, bytes in hexadecimal, and those that are ASCII."""
    for start in range(0, len(data), BYTES_PER_LINE):
        part = data[start : start + BYTES_PER_LINE]
        text = "".join(chr(byte) if 32 <= byte < 127 else "." for byte in part)
        yield f"{start:04x}  {part.hex(' '):<{3 * BYTES_PER_LINE - 1}}  {text}"


def _procedures() -> list[Procedure[Any, Any]]:
    return [value for value in vars(keys).values() if isinstance(value, Procedure)]


def _keys() -> Iterator[str]:
    yield from ("## Topics", "", "| key | message | delivery | latched |", "|---|---|---|---|")
    for topic in topics():
        latched = "yes" if topic.latched else "no"
        yield f"| `{topic.key}` | {_link(topic.message)} | {topic.delivery.value} | {latched} |"
    head = "| key | request | reply | refused after waiting | asked |"
    yield from ("", "## Procedures", "", head, "|---|---|---|---|---|")
    for procedure in _procedures():
        late = "" if procedure.stale_after_s is None else f"{procedure.stale_after_s:g} s"
        if procedure.delivery is Delivery.COMMAND:
            late = "never"
        asked = "all" if procedure.to_all else "one"
        types = f"{_link(procedure.request)} | {_link(procedure.reply)}"
        yield f"| `{procedure.key}` | {types} | {late} | {asked} |"
    token = keys.liveliness(SERVICE, "<instance>")
    lives = f"A process is alive as long as its liveliness token `{token}` is; a robot needs none."
    yield from ("", lives, "")


def _example() -> Iterator[str]:
    packet = wire.encode(EXAMPLE)
    yield from ("## An example", "")
    yield (
        f"[Odometry](#odometry) with `sequence` {EXAMPLE.sequence}, `stamp_ns` "
        f"{EXAMPLE.stamp_ns}, `linear_mps` {EXAMPLE.linear_mps}, `angular_radps` "
        f"{EXAMPLE.angular_radps}, not collided, at x = {EXAMPLE.T_map_body[0, 3]} m, "
        f"y = {EXAMPLE.T_map_body[1, 3]} m, without rotation. The numbers in front are offsets."
    )
    for name, data in (("Header", packet.header), ("Body", packet.body)):
        yield from ("", f"{name}, {len(data)} bytes:", "", "```text", *_hex_dump(data), "```")
    yield ""


def _message(cls: type, common: dict[str, str]) -> Iterator[str]:
    """A heading, what the message is, and a row for each field.

    ValueError if a field is described nowhere, an array without its shape, or what is no field.
    """
    text, own = docstring_parts(cls.__doc__ or "")
    yield from (f"### {cls.__name__}", "", text.replace("``", "`"), "")
    fields = dataclasses.fields(cls)
    wrong = [f.name for f in fields if f.name not in own and f.name not in common]
    wrong += own.keys() - {field.name for field in fields}
    if wrong:
        raise ValueError(f"{cls.__name__}: its fields and 'Attributes:' differ in {wrong}")
    if not fields:
        yield from ("No fields.", "")
        return
    yield from ("| field | type | shape | meaning |", "|---|---|---|---|")
    hints = typing.get_type_hints(cls)
    for field in fields:
        shape, meaning = "", own.get(field.name) or common[field.name]
        if _is_array(hints[field.name]):
            match = SHAPE.fullmatch(meaning)
            if match is None:
                raise ValueError(f"an array's description begins with its shape, not {meaning!r}")
            shape, meaning = match[1], match[2]
        elif field.default is not dataclasses.MISSING and hints[field.name] is not bytes:
            default = json.dumps(field.default, default=dataclasses.asdict)
            meaning += f" May be left out: `{default}`."
        meaning = meaning.replace("``", "`").replace("<", "&lt;")
        yield f"| `{field.name}` | {_kind(hints[field.name])} | {shape} | {meaning} |"
    yield ""


def _enum(kind: type[Enum]) -> Iterator[str]:
    yield from (f"### {kind.__name__}", "", (kind.__doc__ or "").replace("``", "`"), "")
    for member in kind:
        value = int(member.value) if issubclass(kind, IntEnum) else f'"{member.value}"'
        yield f"- `{value}`: {member.name.lower().replace('_', ' ')}"
    yield ""


def _is_array(hint: Any) -> bool:
    return typing.get_origin(hint) is np.ndarray


def _kind(hint: Any) -> str:
    """A field's type as it travels."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if _is_array(hint):
        return f"array of {np.dtype(typing.get_args(arguments[1])[0]).name}"
    if origin is tuple:
        many = arguments[-1] is Ellipsis or len(arguments) < 2
        return f"list of {'' if many else f'{len(arguments)} '}{_kind(arguments[0])}"
    if origin is dict:
        return f"map of {_kind(arguments[0])} to {_kind(arguments[1])}"
    if dataclasses.is_dataclass(hint) or _is_enum(hint):
        return _link(hint)
    return SCALARS[hint]


def _parts(types: Sequence[type]) -> list[type]:
    """The dataclasses and enumerations that fields hold and that are no messages, in order."""
    read = list(types)
    for cls in read:  # which grows
        if not dataclasses.is_dataclass(cls):
            continue
        for hint in typing.get_type_hints(cls).values():
            for kind in (hint, *typing.get_args(hint)):
                if (dataclasses.is_dataclass(kind) or _is_enum(kind)) and kind not in read:
                    read.append(kind)
    return read[len(types) :]


def _is_enum(kind: Any) -> bool:
    return inspect.isclass(kind) and issubclass(kind, Enum)


def _link(cls: Any) -> str:
    return f"[{cls.__name__}](#{cls.__name__.lower()})"


if __name__ == "__main__":
    print(messages_reference(), end="")
