"""ROS 2 messages and their bytes (CDR), by rosbags: no ROS 2 is needed.

The definitions are those of Jazzy. What the adapter uses has had the same layout from Jazzy on;
type hashes are checked where a robot announces its own.
"""

from __future__ import annotations

import struct
from functools import cache
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from onemap_ros2.definitions import register_missing

NS = 1_000_000_000
HEADER_BYTES = 12  # CDR header, seconds, nanoseconds: where the stamp of a std_msgs/Header ends


class FormatError(ValueError):
    """Bytes or fields from the robot that cannot be what they claim to be; one sentence."""


@cache
def store() -> Typestore:
    """The message definitions; made on first use, which takes 0.3 s."""
    made = get_typestore(Stores.ROS2_JAZZY)
    register_missing(made)
    return made


def known(ros_type: str) -> bool:
    """Whether the definition of ``ros_type`` (``pkg/msg/Type``) is here."""
    return ros_type in store().fielddefs


def type_hash(ros_type: str) -> str:
    """The hash of the definition, ``RIHS01_`` and 64 hexadecimal digits."""
    return store().hash_rihs01(ros_type)


def new(ros_type: str, *fields: Any) -> Any:
    """A message with these fields, in the order of its definition."""
    return store().types[ros_type](*fields)


def encode(message: Any, ros_type: str) -> bytes:
    """The message as CDR, little-endian, with its header of four bytes."""
    return bytes(store().serialize_cdr(message, ros_type))


def decode(data: bytes, ros_type: str) -> Any:
    """The message; its arrays are read-only views of ``data``. FormatError if it is none."""
    try:
        return store().deserialize_cdr(memoryview(data), ros_type)  # a slice of bytes is a copy
    except (SerdeError, ValueError) as problem:
        raise FormatError(f"{len(data)} bytes are no {ros_type}: {problem}") from problem


def decode_start(data: bytes, ros_type: str) -> Any:
    """The message at the start of ``data``; later releases append fields to some messages."""
    try:
        if len(data) < 4 or data[0] != 0 or data[1] not in (0, 1):
            raise ValueError("they do not begin with a CDR header")
        layout = store().get_msgdef(ros_type)
        read = layout.deserialize_cdr_le if data[1] else layout.deserialize_cdr_be
        return read(data[4:], 0, layout.cls, store())[0]
    except (SerdeError, ValueError, struct.error) as problem:
        raise FormatError(f"{len(data)} bytes are no {ros_type}: {problem}") from problem


def stamp_ns(stamp: Any) -> int:
    """A ``builtin_interfaces/Time`` in nanoseconds."""
    return int(stamp.sec) * NS + int(stamp.nanosec)


def time_of(stamp: int) -> Any:
    """Nanoseconds as ``builtin_interfaces/Time``."""
    return new("builtin_interfaces/msg/Time", stamp // NS, stamp % NS)


def header(stamp: int, frame: str) -> Any:
    """A ``std_msgs/Header`` with the stamp in nanoseconds."""
    return new("std_msgs/msg/Header", time_of(stamp), frame)


def peek_stamp_ns(data: bytes) -> int:
    """The stamp of a message that begins with a header, without decoding the rest."""
    if len(data) < HEADER_BYTES or data[0] != 0 or data[1] not in (0, 1):
        raise FormatError(f"{len(data)} bytes do not begin with a CDR header and a stamp")
    seconds, nanoseconds = struct.unpack_from("<iI" if data[1] else ">iI", data, 4)
    return int(seconds) * NS + int(nanoseconds)
