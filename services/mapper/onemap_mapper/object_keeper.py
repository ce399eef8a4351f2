"""Keeps the found objects: answers for them on the bus and writes each change to disk."""
# Talks: answers the bus's threads.

from __future__ import annotations

import logging
import secrets
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from onemap_mapper import object_file
from onemap_mapper.objects import ObjectMemory
from onemap_shared import keys
from onemap_shared.messages import (
    KeptObject,
    ObjectFind,
    ObjectId,
    ObjectList,
    ObjectListRequest,
    PicturedObject,
)
from onemap_shared.transport import RequestRejected, Server

LOG = logging.getLogger("onemap.mapper")

HeightOf = Callable[[tuple[float, float, float, float]], tuple[float, ...]]

ID_BYTES = 4  # random, so that a browser never takes an old picture for that of a new object


class ObjectKeeper:
    """The memory of found objects, its file and its procedures.

    ``announce`` is called after every change, without the keeper's lock; ``height_of`` says
    between which heights an object of this extent lies.
    """

    def __init__(
        self,
        bus: Server,
        folder: Path,
        announce: Callable[[], None],
        height_of: HeightOf,
    ) -> None:
        self._folder, self._announce = folder, announce
        self._height_of = height_of
        self._lock = threading.Lock()  # changing memory and file is read, compute, write
        found, problem = object_file.read(folder)
        self._memory = found.limited()
        if problem:
            LOG.error("%s", problem)
        self._problem = ""
        bus.serve(keys.MAP_REMEMBER, self.remember)
        bus.serve(keys.MAP_OBJECTS, self.list_objects)
        bus.serve(keys.MAP_OBJECT, self.get)
        bus.serve(keys.MAP_FORGET, self.forget)

    @property
    def memory(self) -> ObjectMemory:
        """All objects, a value."""
        return self._memory

    @property
    def problem(self) -> str:
        """Why the objects cannot be written, in one sentence; empty if they can."""
        return self._problem

    def remember(self, find: ObjectFind) -> KeptObject:
        """Keep a find; returns the object that it is."""
        new_id, height_m = secrets.token_hex(ID_BYTES), self._height_of(find.extent_m)
        memory = self._change(lambda memory: memory.with_find(find, new_id, height_m))
        known = memory.same_object(find)
        assert known is not None  # it was just put there
        LOG.info("keeping %s, found at (%.2f, %.2f)", find.name, *find.position_m[:2])
        return known.kept

    def list_objects(self, _request: ObjectListRequest) -> ObjectList:
        """All objects without their pictures."""
        return self._memory.listed()

    def get(self, request: ObjectId) -> PicturedObject:
        """One object with its picture."""
        known = self._memory.get(request.object_id)
        if known is None:
            raise RequestRejected(
                "unknown_object",
                f"there is no object {request.object_id!r}: GET /v1/objects lists what was found",
            )
        return known

    def forget(self, request: ObjectId) -> KeptObject:
        """Remove an object, as one that was found wrongly; returns what it was."""
        known = self.get(request).kept
        self._change(lambda memory: memory.without(known.object_id))
        LOG.info("forgot %s at (%.2f, %.2f)", known.name, *known.position_m[:2])
        return known

    def replace(self, objects: ObjectMemory) -> None:
        """Keep these objects instead, because the map is another one."""

        def exchange(memory: ObjectMemory) -> ObjectMemory:
            if not (memory.objects or objects.objects):
                return memory
            return replace(objects, version=memory.version + 1).limited()

        self._change(exchange)

    def _change(self, update: Callable[[ObjectMemory], ObjectMemory]) -> ObjectMemory:
        """Apply a change and write the file; a failed write is reported, the change stays."""
        with self._lock:
            before, self._memory = self._memory, update(self._memory)
            memory = self._memory
            if memory is not before:
                self._write(memory)
        if memory is not before:
            self._announce()
        return memory

    def _write(self, memory: ObjectMemory) -> None:
        try:
            object_file.write(self._folder, memory)
            self._problem = ""
        except OSError as problem:
            self._problem = (
                f"cannot write the found objects to {self._folder}: {problem.strerror}; a restart "
                "of the mapper loses them"
            )
            LOG.error("%s", self._problem)
