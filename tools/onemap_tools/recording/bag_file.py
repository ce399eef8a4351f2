"""MCAP files: written so that a killed process leaves what it wrote, read as far as they go.

A message of ours is stored as the length of its header (4 bytes, little-endian), header and
body, as on the wire; the schema's name is that of the message. Bags of rosbag2 are read in all
that it writes: MCAP and sqlite3, as folders too, plain or with zstd around files or messages.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import struct
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass
from io import BufferedReader, FileIO
from pathlib import Path, PurePath
from tempfile import NamedTemporaryFile, gettempdir
from typing import Any, TypeVar

import yaml
from mcap.records import Channel, Header, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from zstandard import ZstdDecompressor, ZstdError

from onemap_shared import keys
from onemap_shared.keys import Topic
from onemap_shared.messages import MapDigest, TextEmbeddings
from onemap_shared.wire import Packet, WireError, decode, encode, schema
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

M = TypeVar("M")

PROFILE, ENCODING = "onemap", "onemap"
ROS2_PROFILE, CDR = "ros2", "cdr"
METADATA = "metadata.yaml"  # of a folder of rosbag2
ZSTD, SQLITE, ROS1 = b"\x28\xb5\x2f\xfd", b"SQLite format 3\0", b"#ROSBAG V"  # first bytes
ROWS = """SELECT name, type, serialization_format, timestamp, data FROM messages
JOIN topics ON messages.topic_id = topics.id ORDER BY timestamp, messages.id"""
MAX_RECORD_BYTES = 2**30  # a damaged length must not allocate more
LENGTH = struct.Struct("<I")

CUT_OFF = "It was cut off: the recorder was killed, or the disk was full."
FRAMES_HELD = 32  # between two updates: 4 s at 8 Hz, 40 MB of images and 70 MB of features
QUEUE = 512  # odometry at 50 Hz for ten seconds

# Answers of services, recorded as if they were published.
DIGESTS = Topic(keys.MAP_DIGEST.key, MapDigest)
EMBEDDINGS = Topic(keys.EMBED_TEXT.key, TextEmbeddings)
FIELDS, FRAMES, REVISIONS = keys.FIELD, keys.ROBOT_RGBD, keys.MAP_REVISION
QUERIES = keys.MAP_QUERIES
# What is recorded, and how many messages wait. A map's revision names the frame that it fused:
# taken before the features, it is never recorded without a frame that was there when it was.
RECORDED: tuple[tuple[Topic[Any], int], ...] = (
    (FRAMES, FRAMES_HELD),
    (REVISIONS, QUEUE),
    (FIELDS, FRAMES_HELD),
    (QUERIES, QUEUE),
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
    """One recorded message. ``stamp_ns``: its own time, or when it was recorded without one."""

    topic: str
    schema: str
    encoding: str
    sequence: int
    stamp_ns: int
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


def bag_files(path: Path) -> list[Path]:
    """A file itself, or those of a folder of rosbag2 in their order; raises BagError.

    A recorder that was killed leaves a folder without metadata: then its files by their names.
    """
    if not path.is_dir():
        return [path]
    files = [each for each in path.iterdir() if {".mcap", ".db3"} & set(each.suffixes)]
    if (path / METADATA).exists():
        try:
            text = (path / METADATA).read_text(encoding="utf-8")
            said = yaml.safe_load(text)["rosbag2_bagfile_information"]
            files = [path / PurePath(name).name for name in said["relative_file_paths"]]
            packed = said.get("compression_format") or "zstd"
        except (yaml.YAMLError, ValueError, LookupError, TypeError, AttributeError) as problem:
            raise BagError(
                f"{path / METADATA} is not as rosbag2 writes it: without it the files are read."
            ) from problem
        if packed != "zstd":
            raise BagError(f"{path} is compressed with {packed}, only zstd is read: convert it.")
    elif not files:
        raise BagError(
            f"{path} is no recording: it holds no {METADATA}, *.mcap, *.db3, frames.json, "
            "rgb.txt, pose."
        )
    else:
        files.sort(key=lambda each: (len(each.name), each.name))
    return files


class BagReader:
    """Reads a bag from its beginning; ``cut_off`` and ``metadata`` are known at its end."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.profile = ""
        self.cut_off = False
        self._is_mcap = False
        self.metadata: dict[str, dict[str, str]] = {}

    def messages(self) -> Iterator[BagMessage]:
        """All messages in the order in which they were recorded; raises BagError.

        An MCAP file that ends in the middle of a record was cut off: what precedes it is read.
        """
        path = self.path
        try:
            for path in bag_files(self.path):
                with open(path, "rb") as stored:
                    if stored.peek().startswith(ZSTD):
                        plain = ZstdDecompressor().stream_reader(stored, read_across_frames=True)
                        yield from self._file(path, BufferedReader(plain), packed=True)
                    else:
                        yield from self._file(path, stored, packed=False)
        except OSError as problem:
            raise BagError(f"Cannot read {path}: {problem.strerror}.") from problem

    def _file(self, path: Path, file: BufferedReader, *, packed: bool) -> Iterator[BagMessage]:
        """The messages of one file; ``packed``: its bytes on the disk are not those read here."""
        self._is_mcap = False
        try:
            begin = file.peek()
            if begin.startswith(ROS1):
                raise BagError(
                    f"{path} is a bag of ROS 1: 'rosbags-convert --src {path} --dst FOLDER "
                    "--dst-typestore ros2_jazzy' makes a folder that is read."
                )
            if begin.startswith(SQLITE):
                self.profile = ROS2_PROFILE
                with _on_disk(path, file) if packed else nullcontext(path) as database:
                    yield from _rows(path, database)
            else:
                stream = StreamReader(file, validate_crcs=True, record_size_limit=MAX_RECORD_BYTES)
                yield from self._read(stream)
        except (OSError, BagError):
            raise
        except Exception as problem:  # of mcap, its decompressors and struct
            if not self._is_mcap and not isinstance(problem, ZstdError):
                raise BagError(f"{path} is not an MCAP file, nor sqlite3 of rosbag2.") from problem
            if not _is_at_end(file):
                raise BagError(f"{path} is damaged: {problem}.") from problem
            self.cut_off = True

    def _read(self, stream: StreamReader) -> Iterator[BagMessage]:
        schemas: dict[int, str] = {}
        channels: dict[int, Channel] = {}
        for record in stream.records:
            match record:
                case Header():
                    self.profile, self._is_mcap = record.profile, True
                case Schema():
                    schemas[record.id] = record.name
                case Channel():
                    channels[record.id] = record
                case Metadata():
                    self.metadata[record.name] = record.metadata
                case Message():
                    channel = channels[record.channel_id]
                    yield BagMessage(
                        channel.topic,
                        schemas.get(channel.schema_id, ""),
                        channel.message_encoding,
                        record.sequence,
                        record.publish_time,
                        record.log_time,
                        _unpacked(channel.message_encoding, record.data),
                    )
                case _:
                    pass


def _is_at_end(file: BufferedReader) -> bool:
    try:
        return not file.read(1)
    except ZstdError:  # damage, for an end in the middle is none
        return False


def _unpacked(encoding: str, data: bytes) -> bytes:
    """A message as it was published: rosbag2 may compress each; CDR begins with a zero."""
    if encoding == CDR and data.startswith(ZSTD):
        return ZstdDecompressor().decompressobj().decompress(data)
    return data


@contextmanager
def _on_disk(path: Path, file: BufferedReader) -> Iterator[Path]:
    """A copy of an unpacked database, which sqlite3 reads from a disk only."""
    with NamedTemporaryFile(suffix=".db3") as copy:
        try:
            shutil.copyfileobj(file, copy)
            copy.flush()
        except OSError as problem:
            raise BagError(
                f"Cannot unpack {path} into {gettempdir()}: {problem.strerror}; TMPDIR names "
                "another folder."
            ) from problem
        yield Path(copy.name)


def _rows(path: Path, database: Path) -> Iterator[BagMessage]:
    try:
        with closing(
            sqlite3.connect(f"{database.absolute().as_uri()}?mode=ro", uri=True)
        ) as opened:
            for topic, schema, encoding, at_ns, data in opened.execute(ROWS):
                plain = _unpacked(encoding, data)
                yield BagMessage(topic, schema, encoding, 0, at_ns, at_ns, plain)
    except (sqlite3.Error, ZstdError) as problem:
        raise BagError(f"{path} is damaged: {problem}.") from problem


def is_ros2(path: Path) -> bool:
    """Whether a file is a ROS 2 bag, by its profile or its first message; raises BagError."""
    reader = BagReader(path)
    first = next(reader.messages(), None)
    return reader.profile == ROS2_PROFILE or (first is not None and first.encoding == CDR)
