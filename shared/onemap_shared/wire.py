"""Messages as bytes: a msgpack header, and one body with every array, aligned.

The header names the schema, the scalar fields and, for each array, dtype,
shape and offset. Everything is checked before a byte is interpreted: a bad packet
is refused with the reason, never decoded in part. No pickle.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Callable, Mapping
from dataclasses import MISSING
from enum import Enum
from functools import cache
from math import prod
from typing import Any, NamedTuple, TypeVar

import msgpack
import numpy as np

from onemap_shared.compression import Codec, CompressionError, decompress

M = TypeVar("M")

VERSION = 1  # of this layout; a receiver refuses any other
MAX_HEADER_BYTES = 256 * 1024  # 256 texts of 200 characters in any script
MAX_BODY_BYTES = 64 * 2**20  # a 4096 x 4096 RGB image with room to spare
MAX_REASON_CHARS = 200
MAX_DIMENSIONS = 3
ALIGNMENT = 8  # so that float64 views of the body are aligned
DTYPES = {dtype: np.dtype(dtype) for dtype in ("|u1", "<u2", "<i4", "<i8", "<f2", "<f4", "<f8")}


class WireError(ValueError):
    """A packet that is not a valid message; the text says why, in ``MAX_REASON_CHARS`` at most."""

    def __init__(self, reason: str) -> None:
        # a reason quotes the packet, which may hold a quarter of a megabyte in one name
        super().__init__(
            reason if len(reason) <= MAX_REASON_CHARS else reason[: MAX_REASON_CHARS - 1] + "…"
        )


@dataclasses.dataclass(frozen=True, slots=True)
class Packet:
    """An encoded message: the header travels as attachment, the body as payload."""

    header: bytes
    body: bytes


def schema(message: type) -> str:
    """The name under which a message type travels."""
    return f"onemap.{message.__name__}/{VERSION}"


class _Field(NamedTuple):
    """A field of a message; optional: it has a default, so that senders may leave it out."""

    name: str
    hint: Any
    is_array: bool
    optional: bool


def _described(message: Any) -> tuple[_Field, ...]:
    hints = typing.get_type_hints(message)
    return tuple(
        _Field(
            field.name,
            hints[field.name],
            _is_array(hints[field.name]),
            field.default is not MISSING or field.default_factory is not MISSING,
        )
        for field in dataclasses.fields(message)
    )


_fields: Callable[[Any], tuple[_Field, ...]] = cache(_described)


def _is_array(hint: Any) -> bool:
    """Whether a field travels in the body: arrays do, and bytes."""
    return typing.get_origin(hint) is np.ndarray or hint in (np.ndarray, bytes)


def encode(message: object, compressions: Mapping[str, Codec] | None = None) -> Packet:
    """The packet of a message dataclass; ``compressions`` by the names of its arrays."""
    values: dict[str, Any] = {}
    arrays: dict[str, list[Any]] = {}
    chunks: list[Any] = []
    offset = 0
    for name, hint, is_array, _ in _fields(type(message)):
        value = getattr(message, name)
        if not is_array:
            values[name] = _plain(value, hint)
            continue
        value = np.frombuffer(value, np.uint8) if hint is bytes else value
        array = np.ascontiguousarray(value, dtype=value.dtype.newbyteorder("<"))
        arrays[name] = [array.dtype.str, list(array.shape), offset]
        data: Any = array.reshape(-1).view(np.uint8).data
        if compressions and name in compressions:
            data = compressions[name].compress(array)
            arrays[name] += [compressions[name].value, len(data)]
        padding = -len(data) % ALIGNMENT
        chunks += [data, bytes(padding)]
        offset += len(data) + padding
    header = {"schema": schema(type(message)), "values": values, "arrays": arrays}
    packed: bytes = msgpack.packb(header)
    return Packet(packed, b"".join(chunks))


def decode(message: type[M], packet: Packet) -> M:
    """The message of a packet; arrays are read-only views of its body. Raises WireError."""
    header = _header(message, packet)
    content: dict[str, Any] = {}
    try:
        for name, hint, is_array, optional in _fields(message):
            kind = header["arrays" if is_array else "values"]
            if name not in kind and optional:
                continue
            if is_array:
                array = _array(name, kind.get(name), packet.body)
                content[name] = _bytes(name, array) if hint is bytes else array
            else:
                content[name] = _typed(name, kind.get(name), hint)
        return message(**content)
    except (ValueError, TypeError) as problem:
        raise WireError(f"{message.__name__}: {problem}") from problem


def _header(message: type, packet: Packet) -> dict[str, Any]:
    for part, size, limit in (
        ("header", len(packet.header), MAX_HEADER_BYTES),
        ("body", len(packet.body), MAX_BODY_BYTES),
    ):
        if size > limit:
            raise WireError(f"{message.__name__}: {part} has {size} bytes, limit {limit}")
    try:
        header = msgpack.unpackb(packet.header, strict_map_key=True)
    except Exception as problem:  # msgpack raises its own and several builtin types
        raise WireError(f"{message.__name__}: header is not msgpack: {problem}") from problem
    if not isinstance(header, dict) or not all(
        isinstance(header.get(key), kind)
        for key, kind in (("schema", str), ("values", dict), ("arrays", dict))
    ):
        raise WireError(f"{message.__name__}: header lacks schema, values or arrays")
    if header["schema"] != schema(message):
        raise WireError(
            f"{message.__name__}: packet has schema {header['schema']!r}, "
            f"this version reads {schema(message)!r}"
        )
    return header


def _array(name: str, description: Any, body: bytes) -> np.ndarray:
    codec: str | None = None
    size = 0
    match description:
        case [str(dtype_name), list(shape), int(offset)]:
            pass
        case [str(dtype_name), list(shape), int(offset), str(codec), int(size)]:
            pass
        case _:
            raise WireError(f"array {name} is missing or not described")
    dtype = DTYPES.get(dtype_name)
    if dtype is None:
        raise WireError(f"array {name} has dtype {dtype_name!r}; allowed are {', '.join(DTYPES)}")
    if len(shape) > MAX_DIMENSIONS or not all(type(n) is int and n >= 0 for n in shape):
        raise WireError(f"array {name} has shape {shape}: at most {MAX_DIMENSIONS} lengths >= 0")
    if codec is None:
        size = prod(shape) * dtype.itemsize
    elif prod(shape) * dtype.itemsize > MAX_BODY_BYTES:
        raise WireError(f"array {name} of shape {shape} takes more than {MAX_BODY_BYTES} bytes")
    if offset < 0 or size < 0 or offset + size > len(body):
        raise WireError(
            f"array {name} needs bytes {offset} to {offset + size}, the body has {len(body)}"
        )
    if codec is not None:
        try:
            return decompress(codec, body[offset : offset + size], dtype, tuple(shape))
        except CompressionError as problem:
            raise WireError(f"array {name} {problem}") from problem
    return np.frombuffer(body, dtype, count=prod(shape), offset=offset).reshape(shape)


def _bytes(name: str, array: np.ndarray) -> bytes:
    if array.dtype != np.uint8 or array.ndim != 1:
        raise WireError(f"array {name} is {array.dtype} {array.shape}; expected uint8 (any,)")
    return array.tobytes()


@cache
def _parts(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """Origin and arguments of a type; asking for them takes as long as to read a value."""
    return typing.get_origin(hint), typing.get_args(hint)


def _plain(value: Any, hint: Any) -> Any:
    """A field's value as msgpack types."""
    if value.__class__ is hint and hint in _SCALARS:
        return value
    origin, arguments = _parts(hint)
    if origin is tuple:
        kinds = [arguments[0]] * len(value) if arguments[-1] is Ellipsis else arguments
        return [_plain(item, kind) for item, kind in zip(value, kinds, strict=True)]
    if origin is dict:
        return {key: _plain(item, arguments[1]) for key, item in value.items()}
    if dataclasses.is_dataclass(hint):
        return {name: _plain(getattr(value, name), kind) for name, kind, *_ in _fields(hint)}
    if issubclass(hint, Enum):
        return value.value
    return hint(value)


MAX_INT = 2**63 - 1  # arrays of stamps and sequences hold no larger ones
_SCALARS: dict[type, tuple[tuple[type, ...], Callable[[Any], Any]]] = {
    int: ((int,), int),
    float: ((float, int), float),
    str: ((str,), str),
    bool: ((bool,), bool),
}


def _typed(name: str, value: Any, hint: Any) -> Any:
    """A field's value from msgpack types, or WireError."""
    origin, arguments = _parts(hint)
    if origin is tuple and isinstance(value, list):
        if arguments[-1] is Ellipsis:
            return tuple(_typed(name, item, arguments[0]) for item in value)
        if len(value) == len(arguments):
            return tuple(
                _typed(name, item, kind) for item, kind in zip(value, arguments, strict=True)
            )
    if origin is dict and isinstance(value, dict):
        return {_typed(name, k, str): _typed(name, v, arguments[1]) for k, v in value.items()}
    if not isinstance(hint, types.GenericAlias) and isinstance(hint, type):
        if dataclasses.is_dataclass(hint) and isinstance(value, dict):
            known = [each for each in _fields(hint) if each.name in value or not each.optional]
            make: Callable[..., Any] = hint
            return make(**{n: _typed(f"{name}.{n}", value.get(n), kind) for n, kind, *_ in known})
        if issubclass(hint, Enum):
            return hint(value)
        accepted, convert = _SCALARS.get(hint, ((), hint))
        if type(value) in accepted:
            if hint is int and value > MAX_INT:
                raise WireError(f"field {name} is {value}; the largest number is {MAX_INT}")
            return convert(value)
    wanted = getattr(hint, "__name__", str(hint))
    if value is None:
        raise WireError(f"field {name} ({wanted}) is missing: docs/messages.md lists all fields")
    raise WireError(f"field {name} is {type(value).__name__}, expected {wanted}")
