"""Recordings as MCAP files: a killed recorder leaves what it wrote, read as far as it goes.

A message is stored as the length of its header (4 bytes, little-endian), header and body, as on the
wire; the schema's name is that of the message.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from io import BufferedReader, FileIO
from pathlib import Path
from typing import Any, TypeVar

from mcap.records import Channel, Header, Message
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from onemap_shared import keys
from onemap_shared.keys import Topic
from onemap_shared.wire import Packet, WireError, decode, encode, schema
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

M = TypeVar("M")

PROFILE, ENCODING = "onemap", "onemap"
MAGIC = b"\x89MCAP0\r\n"
MAX_RECORD_BYTES = 2**30  # a damaged length must not allocate more
LENGTH = struct.Struct("<I")

CUT_OFF = "It was cut off: the recorder was killed, or the disk was full."
FRAMES_HELD = 32  # between two updates: 4 s at 8 Hz, 40 MB of images and 70 MB of features
QUEUE = 512  # odometry at 50 Hz for ten seconds

FIELDS, FRAMES = keys.FIELD, keys.ROBOT_RGBD
# What is recorded, and how many messages wait.
RECORDED: tuple[tuple[Topic[Any], int], ...] = (
    (FRAMES, FRAMES_HELD),
    (FIELDS, FRAMES_HELD),
    (keys.MAP_REVISION, QUEUE),
    (keys.ROBOT_ODOMETRY, QUEUE),
    (keys.ROBOT_CMD_VEL, QUEUE),
    (keys.DETECTIONS, QUEUE),
    (keys.SEARCH_STATE, QUEUE),
    (keys.SEARCH_PATH, QUEUE),
    (keys.ALL_HEARTBEATS, QUEUE),
)


class BagError(CliError):
    """A file that cannot be read, or no longer written; the text says why in one sentence."""

    def __init__(self, sentence: str) -> None:
        super().__init__(sentence, EXIT_USAGE_ERROR)


@dataclass(frozen=True, slots=True)
class BagMessage:
    """One recorded message, and when it was recorded."""

    topic: str
    sequence: int
    log_time_ns: int
    data: bytes

    def decode(self, message: type[M]) -> M:
        """The message, or BagError."""
        if len(self.data) < LENGTH.size:
            raise BagError(f"A message on {self.topic} has {len(self.data)} bytes: it is damaged.")
        end = LENGTH.size + LENGTH.unpack_from(self.data)[0]
        try:
            return decode(message, Packet(self.data[LENGTH.size : end], self.data[end:]))
        except WireError as problem:
            raise BagError(f"A message on {self.topic} cannot be read: {problem}.") from problem


class _WholeWrites:
    """A file without a buffer: what was written before a failure is known to the byte."""

    def __init__(self, file: FileIO) -> None:
        self.file = file
        self.size = 0

    def write(self, data: bytes) -> int:
        view = memoryview(data)
        while view:
            view = view[self.file.write(view) :]
        self.size += len(data)
        return len(data)

    def tell(self) -> int:
        return self.size

    def flush(self) -> None:
        pass


class BagWriter:
    """Writes a new file. After a BagError, the file ends with the last whole message."""

    def __init__(self, path: Path, metadata: Mapping[str, Mapping[str, str]]) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._output = _WholeWrites(FileIO(path, "x"))
        except FileExistsError:
            raise BagError(f"{path} exists: a recording is not overwritten.") from None
        except OSError as problem:
            raise BagError(f"Cannot write {path}: {problem.strerror}.") from problem
        self._writer = Writer(self._output)  # type: ignore[arg-type]
        self._channels: dict[str, int] = {}
        self._whole = 0  # bytes up to the end of the last whole chunk
        with self._guarded():
            self._writer.start(profile=PROFILE)
            for name, values in metadata.items():
                self._writer.add_metadata(name, dict(values))

    @property
    def size(self) -> int:
        """Bytes in the file."""
        return self._output.size

    def write(self, topic: str, message: object, log_time_ns: int) -> None:
        """Add a message; raises BagError if the disk takes no more."""
        packet = encode(message)
        with self._guarded():
            if topic not in self._channels:
                name = self._writer.register_schema(schema(type(message)), "", b"")
                self._channels[topic] = self._writer.register_channel(topic, ENCODING, name)
            self._writer.add_message(
                self._channels[topic],
                log_time=log_time_ns,
                data=LENGTH.pack(len(packet.header)) + packet.header + packet.body,
                publish_time=getattr(message, "stamp_ns", 0) or log_time_ns,
                sequence=getattr(message, "sequence", 0) % 2**32,
            )

    def sync(self) -> None:
        """Put everything written so far on the disk; a killed process loses what came later."""
        with self._guarded():
            self._writer.flush()  # type: ignore[no-untyped-call]
            os.fsync(self._output.file.fileno())

    def close(self, summary: Mapping[str, str]) -> None:
        """Complete the file with its index and these values as the metadata ``end``."""
        with self._guarded():
            self._writer.add_metadata("end", dict(summary))
            self._writer.finish()  # type: ignore[no-untyped-call]
            os.fsync(self._output.file.fileno())
        self._output.file.close()

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        """Count what is written inside as whole, or cut off what was written in part."""
        try:
            yield
        except OSError as problem:
            self._output.file.truncate(self._whole)
            self._output.file.close()
            raise BagError(
                f"The recording ended because {self.path} cannot be written any more: "
                f"{problem.strerror}; what was recorded before, {self._whole / 1e6:.1f} MB, can "
                "be read."
            ) from problem
        self._whole = self._output.size


class BagReader:
    """Reads a recording from its beginning; ``cut_off`` is known at its end."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.cut_off = False

    def messages(self) -> Iterator[BagMessage]:
        """All messages in the order in which they were recorded; raises BagError.

        A file that ends in the middle of a record was cut off: what precedes it is read.
        """
        channels: dict[int, str] = {}
        for record in self._records():
            match record:
                case Header() if record.profile != PROFILE:
                    raise BagError(
                        f"{self.path} is no recording of 'onemap record': a bag of ROS 2 is "
                        "played with 'ros2 bag play' beside 'onemap up'."
                    )
                case Channel():
                    channels[record.id] = record.topic
                case Message():
                    yield BagMessage(
                        channels[record.channel_id],
                        record.sequence,
                        record.log_time,
                        record.data,
                    )
                case _:
                    pass

    def _records(self) -> Iterator[object]:
        try:
            with open(self.path, "rb") as file:
                if not file.peek().startswith(MAGIC):
                    raise BagError(f"{self.path} is not an MCAP file.")
                yield from self._read(file)
        except OSError as problem:
            raise BagError(f"Cannot read {self.path}: {problem.strerror}.") from problem

    def _read(self, file: BufferedReader) -> Iterator[object]:
        try:
            stream = StreamReader(file, validate_crcs=True, record_size_limit=MAX_RECORD_BYTES)
            yield from stream.records
        except OSError:
            raise
        except Exception as problem:  # of mcap, its decompressors and struct
            if file.read(1):
                raise BagError(f"{self.path} is damaged: {problem}.") from problem
            self.cut_off = True
