"""The found objects: what is kept of them, their form on disk, and who answers for them."""
# Talks: answers the bus's threads.

from __future__ import annotations

import logging
import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import hypot, inf
from pathlib import Path

from onemap_mapper.storage.kept import Form, Kept
from onemap_shared import keys
from onemap_shared.messages import (
    KeptObject,
    ObjectFind,
    ObjectId,
    ObjectList,
    ObjectListRequest,
    PicturedObject,
)
from onemap_shared.names import same_name
from onemap_shared.transport import Bus, RequestRejected, Server
from onemap_shared.wire import Packet, decode, encode

# A find of the same name within this distance along the floor is the same object seen again. The
# middle of what is seen of a bed moves by up to half its size with the side it is seen from.
SAME_OBJECT_M = 1.0
# That are kept; the one found longest ago makes room. Their pictures, some 30 kB each, lie in
# memory and are written again with every find.
MAX_OBJECTS = 100
HEADER_LENGTH = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class ObjectMemory:
    """Found objects with their pictures, the one found last at the end.

    version: changes whenever the objects do; left_out: objects that had to make room.
    """

    objects: tuple[PicturedObject, ...] = ()
    version: int = 0
    left_out: int = 0

    def listed(self) -> ObjectList:
        """All objects without their pictures, the one found last first."""
        return ObjectList(tuple(entry.kept for entry in reversed(self.objects)), self.left_out)

    def get(self, object_id: str) -> PicturedObject | None:
        """The object with this id; None if there is none."""
        return next((o for o in self.objects if o.kept.object_id == object_id), None)

    def with_find(
        self,
        find: ObjectFind,
        new_id: str,
        height_m: tuple[float, ...] = (),
        robot: str = "",
    ) -> ObjectMemory:
        """The memory after a find: of a known object, which keeps its id, or of a new one.

        height_m: between which heights it lies; empty: not known. robot: namespace of the finder.
        A find that was remembered before, as when its sender did not hear of it, changes nothing.
        """
        known = self.same_object(find)
        if known is not None and _is_repeated(known.kept, find):
            return self
        kept = _first_time(find, new_id) if known is None else _again(known.kept, find)
        kept = replace(kept, height_m=height_m, robot=robot)
        others = tuple(entry for entry in self.objects if entry is not known)
        objects = (*others, PicturedObject(kept, find.picture))
        return replace(self, objects=objects, version=self.version + 1).limited()

    def without(self, object_id: str) -> ObjectMemory:
        """The memory without the object of this id."""
        left = tuple(entry for entry in self.objects if entry.kept.object_id != object_id)
        return replace(self, objects=left, version=self.version + 1)

    def changed_to(self, objects: ObjectMemory) -> ObjectMemory:
        """These objects instead; the same memory if neither has one."""
        if not (self.objects or objects.objects):
            return self
        return replace(objects, version=self.version + 1).limited()

    def limited(self) -> ObjectMemory:
        """The memory with at most ``MAX_OBJECTS``; those found longest ago are left out."""
        surplus = max(len(self.objects) - MAX_OBJECTS, 0)
        return replace(self, objects=self.objects[surplus:], left_out=self.left_out + surplus)

    def same_object(self, find: ObjectFind | KeptObject) -> PicturedObject | None:
        """The nearest object of this name within ``SAME_OBJECT_M``; None if there is none."""
        x_m, y_m = find.position_m[:2]
        near = [
            (hypot(entry.kept.position_m[0] - x_m, entry.kept.position_m[1] - y_m), index)
            for index, entry in enumerate(self.objects)
            if same_name(entry.kept.name, find.name)
        ]
        distance_m, index = min(near, default=(inf, 0))
        return self.objects[index] if distance_m <= SAME_OBJECT_M else None


NO_OBJECTS = ObjectMemory()


def to_bytes(memory: ObjectMemory) -> bytes:
    """The memory as it is saved: the length of the header, the header, the body of a packet."""
    packet = encode(
        ObjectArchive(
            objects=tuple(entry.kept for entry in memory.objects),
            version=memory.version,
            left_out=memory.left_out,
            pictures=b"".join(entry.picture for entry in memory.objects),
        )
    )
    return HEADER_LENGTH.pack(len(packet.header)) + packet.header + packet.body


def from_bytes(data: bytes) -> ObjectMemory:
    """The memory that was saved as ``data``; raises ValueError if that is damaged."""
    if len(data) < HEADER_LENGTH.size:
        raise ValueError(f"the found objects have {len(data)} bytes: their beginning is missing")
    (length,) = HEADER_LENGTH.unpack_from(data)
    body_at = HEADER_LENGTH.size + length
    archive = decode(ObjectArchive, Packet(data[HEADER_LENGTH.size : body_at], data[body_at:]))
    objects, begin = [], 0
    for kept in archive.objects:
        end = begin + kept.picture_bytes
        objects.append(PicturedObject(kept, archive.pictures[begin:end]))
        begin = end
    return ObjectMemory(tuple(objects), archive.version, archive.left_out)


@dataclass(frozen=True, slots=True)
class ObjectArchive:
    """The objects as they are encoded; pictures: all of them, one after the other."""

    objects: tuple[KeptObject, ...]
    version: int
    left_out: int
    pictures: bytes

    def __post_init__(self) -> None:
        expected = sum(kept.picture_bytes for kept in self.objects)
        if expected != len(self.pictures):
            raise ValueError(f"the pictures have {len(self.pictures)} bytes, expected {expected}")
        if len({kept.object_id for kept in self.objects}) < len(self.objects):
            raise ValueError("two objects have the same id")
        if min(self.version, self.left_out) < 0:
            raise ValueError("version and left_out must not be negative")


def _is_repeated(known: KeptObject, find: ObjectFind) -> bool:
    return (known.search_id, known.last_seen_ns, known.position_m) == (
        find.search_id,
        find.stamp_ns,
        find.position_m,
    )


def _first_time(find: ObjectFind, object_id: str) -> KeptObject:
    return KeptObject(
        object_id=object_id,
        name=find.name,
        position_m=find.position_m,
        extent_m=find.extent_m,
        score=find.score,
        times_found=1,
        search_id=find.search_id,
        first_found_ns=find.stamp_ns,
        last_seen_ns=find.stamp_ns,
        box_px=find.box_px,
        picture_bytes=len(find.picture),
    )


def _again(known: KeptObject, find: ObjectFind) -> KeptObject:
    newest = _first_time(find, known.object_id)
    return replace(newest, times_found=known.times_found + 1, first_found_ns=known.first_found_ns)


FORM = Form(
    "the found objects",
    "objects.bin",
    NO_OBJECTS,
    lambda memory: to_bytes(memory) if memory.objects else b"",
    lambda data: from_bytes(data).limited(),
)
LOG = logging.getLogger("onemap.mapper")

HeightOf = Callable[[tuple[float, float, float, float]], tuple[float, ...]]
Tell = Callable[[Sequence[KeptObject]], Sequence[KeptObject]]

ID_BYTES = 4  # random, so that a browser never takes an old picture for that of a new object


class ObjectKeeper:
    """The memory of found objects and its procedures.

    ``announce`` is called after every change; ``height_of`` says between which heights an object
    of this extent lies, ``tell`` adds where each find is in words. A find is its whose keys name
    it: ``robots`` are the buses of the robots of the map.
    """

    def __init__(
        self,
        bus: Server,
        robots: Iterable[Bus],
        folder: Path,
        announce: Callable[[], None],
        height_of: HeightOf,
        *,
        tell: Tell,
    ) -> None:
        self.kept = Kept(folder, FORM, announce, bus.clock)
        self._height_of, self._tell, self._clock = height_of, tell, bus.clock
        for robot in robots:
            robot.serve(keys.MAP_REMEMBER, partial(self.remember, robot.namespace))
        bus.serve(keys.MAP_OBJECTS, self.list_objects)
        bus.serve(keys.MAP_OBJECT, self.get)
        bus.serve(keys.MAP_FORGET, self.forget)

    @property
    def memory(self) -> ObjectMemory:
        """What is kept."""
        return self.kept.value

    @property
    def problem(self) -> str:
        """Why the objects were lost or cannot be written, in one sentence; else empty."""
        return self.kept.problem

    def remember(self, robot: str, find: ObjectFind) -> KeptObject:
        """Keep a find of the robot with this namespace; returns the object that it is."""
        new_id = self._clock.random.randbytes(ID_BYTES).hex()
        height_m = self._height_of(find.extent_m)
        memory = self.kept.change(lambda memory: memory.with_find(find, new_id, height_m, robot))
        known = memory.same_object(find)
        assert known is not None  # it was just put there
        LOG.info("keeping %s, found at (%.2f, %.2f)", find.name, *find.position_m[:2])
        return known.kept

    def list_objects(self, _request: ObjectListRequest) -> ObjectList:
        """All objects without their pictures."""
        listed = self.memory.listed()
        return replace(listed, objects=tuple(self._tell(listed.objects)))

    def get(self, request: ObjectId) -> PicturedObject:
        """One object with its picture."""
        known = self.memory.get(request.object_id)
        if known is None:
            raise RequestRejected(
                "unknown_object",
                f"there is no object {request.object_id!r}: GET /v1/objects lists what was found",
            )
        return replace(known, kept=self._tell([known.kept])[0])

    def forget(self, request: ObjectId) -> KeptObject:
        """Remove an object, as one that was found wrongly; returns what it was."""
        known = self.get(request).kept
        self.kept.change(lambda memory: memory.without(known.object_id))
        LOG.info("forgot %s at (%.2f, %.2f)", known.name, *known.position_m[:2])
        return known
