"""The page of messages: keys, wire layout with an example, and every field of every message."""

from __future__ import annotations

import dataclasses
import json
import typing
from collections.abc import Iterator, Sequence
from enum import Enum, IntEnum
from typing import Any

import numpy as np

from onemap_shared import keys, messages, wire
from onemap_shared.keys import Procedure, Topic
from onemap_tools.docs.field_notes import field_notes, parse, split_shape
from onemap_tools.docs.messages_text import ENUMS, INTRODUCTION, LAYOUT

# Without rotation, at x = 1.5 m, y = -2 m.
POSE = np.array([[1.0, 0, 0, 1.5], [0, 1, 0, -2], [0, 0, 1, 0], [0, 0, 0, 1]])
EXAMPLE = messages.Odometry(41, 1_700_000_000_000_000_000, POSE, 0.5, -0.25)
SERVICE, INSTANCE = "<service>", "<instance>"
BYTES_PER_LINE = 16
ENUMERATIONS = (
    messages.SearchKind,
    messages.SearchOrder,
    messages.SearchState,
    messages.FailureCode,
    messages.Verdict,
    messages.Occupancy,
    messages.Layer,
)
SCALARS = {int: "integer", float: "number", str: "string", bool: "boolean", bytes: "bytes"}


def messages_page() -> str:
    """The page as Markdown."""
    types = list(message_types())
    common = parse(messages.__doc__ or "").fields
    lines = [INTRODUCTION, *_keys(), *_layout(), "## Messages", ""]
    for cls in types:
        lines += _message(cls, common)
    lines += ["## Values of several fields", ""]
    for cls in _nested(types):
        lines += _message(cls, common)
    lines += [ENUMS]
    for kind in ENUMERATIONS:
        lines += _enum(kind)
    return "\n".join(lines).rstrip() + "\n"


def topics() -> list[Topic[Any]]:
    """Every topic, with the heartbeat of any service."""
    fixed = [value for value in vars(keys).values() if isinstance(value, Topic)]
    return [t for t in fixed if t is not keys.ALL_HEARTBEATS] + [keys.heartbeat(SERVICE)]


def procedures() -> list[Procedure[Any, Any]]:
    """Every procedure."""
    return [value for value in vars(keys).values() if isinstance(value, Procedure)]


def message_types() -> Iterator[type]:
    """Every type that travels under a key, once, in the order of the keys."""
    listed = [topic.message for topic in topics()]
    listed += [cls for p in procedures() for cls in (p.request, p.reply)]
    yield from dict.fromkeys(listed)


def _keys() -> Iterator[str]:
    yield "## Topics"
    yield ""
    yield "| key | message | delivery | latched |"
    yield "|---|---|---|---|"
    for topic in topics():
        latched = "yes" if topic.latched else "no"
        yield f"| `{topic.key}` | {_link(topic.message)} | {topic.delivery.value} | {latched} |"
    yield ""
    yield "## Procedures"
    yield ""
    yield "| key | request | reply | refused after waiting | asked |"
    yield "|---|---|---|---|---|"
    for procedure in procedures():
        late = f"{procedure.stale_after_s:g} s" if procedure.stale_after_s is not None else "never"
        yield (
            f"| `{procedure.key}` | {_link(procedure.request)} | {_link(procedure.reply)} "
            f"| {late} | {'all' if procedure.to_all else 'one'} |"
        )
    yield ""
    token = keys.liveliness(SERVICE, INSTANCE)
    yield f"A process is alive as long as its liveliness token `{token}` is; a robot needs none."
    yield ""


def _layout() -> Iterator[str]:
    packet = wire.encode(EXAMPLE)
    yield LAYOUT.format(
        version=wire.VERSION,
        header_bytes=wire.MAX_HEADER_BYTES,
        body_bytes=wire.MAX_BODY_BYTES,
        dimensions=wire.MAX_DIMENSIONS,
        alignment=wire.ALIGNMENT,
        dtypes=", ".join(f"`{name}` {dtype.name}" for name, dtype in wire.DTYPES.items()),
    )
    yield (
        f"For example [Odometry](#odometry) with `sequence` {EXAMPLE.sequence}, `stamp_ns` "
        f"{EXAMPLE.stamp_ns}, `linear_mps` {EXAMPLE.linear_mps}, `angular_radps` "
        f"{EXAMPLE.angular_radps}, not collided, at x = {POSE[0, 3]} m, y = {POSE[1, 3]} m, "
        "without rotation. The numbers in front are offsets."
    )
    yield ""
    for name, data in (("Header", packet.header), ("Body", packet.body)):
        yield f"{name}, {len(data)} bytes:"
        yield ""
        yield "```text"
        yield from hex_dump(data)
        yield "```"
        yield ""


def hex_dump(data: bytes) -> Iterator[str]:
    """Lines of offset, bytes in hexadecimal, and those that are ASCII."""
    for start in range(0, len(data), BYTES_PER_LINE):
        part = data[start : start + BYTES_PER_LINE]
        text = "".join(chr(byte) if 32 <= byte < 127 else "." for byte in part)
        yield f"{start:04x}  {part.hex(' '):<{3 * BYTES_PER_LINE - 1}}  {text}"


def _message(cls: type, common: dict[str, str]) -> Iterator[str]:
    yield f"### {cls.__name__}"
    yield ""
    yield parse(cls.__doc__ or "").text.replace("``", "`")
    yield ""
    notes = field_notes(cls, common)
    if not notes:
        yield "No fields."
        yield ""
        return
    yield "| field | type | shape | meaning |"
    yield "|---|---|---|---|"
    hints = typing.get_type_hints(cls)
    for name, note in notes.items():
        shape, meaning = split_shape(note) if _is_array(hints[name]) else ("", note)
        meaning += _if_left_out(cls, name)
        meaning = meaning.replace("``", "`").replace("<", "&lt;")
        yield f"| `{name}` | {_kind(hints[name])} | {shape} | {meaning} |"
    yield ""


def _if_left_out(cls: type, name: str) -> str:
    """The default of a field that was added to the message later; empty for the others."""
    (each,) = (each for each in dataclasses.fields(cls) if each.name == name)
    return f" May be left out: `{json.dumps(each.default)}`." if each.metadata.get("added") else ""


def _enum(kind: type[Enum]) -> Iterator[str]:
    yield f"### {kind.__name__}"
    yield ""
    yield (kind.__doc__ or "").replace("``", "`")
    yield ""
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
        count = "" if many else f"{len(arguments)} "
        return f"list of {count}{_kind(arguments[0])}"
    if origin is dict:
        return f"map of {_kind(arguments[0])} to {_kind(arguments[1])}"
    if dataclasses.is_dataclass(hint) or issubclass(hint, Enum):
        return _link(hint)
    return SCALARS[hint]


def _nested(types: Sequence[type]) -> list[type]:
    """The dataclasses that are values of fields and no messages, in the order of occurrence."""
    found: dict[type, None] = {}
    waiting = list(types)
    for cls in waiting:  # grows by what is found
        for hint in typing.get_type_hints(cls).values():
            for kind in (hint, *typing.get_args(hint)):
                if dataclasses.is_dataclass(kind) and isinstance(kind, type):
                    waiting += [kind] if kind not in found and kind not in types else []
                    found[kind] = None
    return [cls for cls in found if cls not in types]


def _link(cls: Any) -> str:
    return f"[{cls.__name__}](#{cls.__name__.lower()})"
