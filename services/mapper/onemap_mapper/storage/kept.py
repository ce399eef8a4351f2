"""What is kept beside the map in a file of its own, written with every change."""
# Talks: logs; changes come from several threads.
# Touches files: what is kept.

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from onemap_shared.atomic_file import replacing

LOG = logging.getLogger("onemap.mapper")
M = TypeVar("M")


@dataclass(frozen=True, slots=True)
class Form(Generic[M]):
    """What is kept, in words; its file; its bytes, which are empty where no file is needed.

    from_bytes: raises ValueError for damaged ones. file_name: without the suffix of a map, so that
    it is not listed as one.
    """

    what: str
    file_name: str
    nothing: M
    to_bytes: Callable[[M], bytes]
    from_bytes: Callable[[bytes], M]


class Kept(Generic[M]):
    """A value that outlives a crash of the mapper.

    problem: why it was lost or cannot be written, in one sentence; else empty. ``announce`` is
    called after every change, without the lock.
    """

    def __init__(self, folder: Path, form: Form[M], announce: Callable[[], None]) -> None:
        self._path, self._form, self._announce = folder / form.file_name, form, announce
        self._lock = threading.Lock()  # changing value and file is read, compute, write
        self.problem = ""
        self.value = self._read()

    def change(self, update: Callable[[M], M]) -> M:
        """Apply a change and write the file; a failed write is reported, the change stays."""
        with self._lock:
            before, self.value = self.value, update(self.value)
            value = self.value
            if value is not before:
                self._write(value)
        if value is not before:
            self._announce()
        return value

    def _read(self) -> M:
        """The value of the file; one that cannot be read is renamed, so that it stays."""
        try:
            return self._form.from_bytes(self._path.read_bytes())
        except FileNotFoundError:
            return self._form.nothing
        except (OSError, ValueError) as problem:
            self._report(f"{self._form.what} are lost: {problem}; {self._set_aside()}")
            return self._form.nothing

    def _set_aside(self) -> str:
        aside = self._path.with_name(f"{self._path.name}.unreadable")
        try:
            self._path.replace(aside)
        except OSError as problem:
            return f"{self._path} cannot be renamed either: {problem.strerror}"
        return f"{self._path} is now {aside.name}"

    def _write(self, value: M) -> None:
        try:
            if data := self._form.to_bytes(value):
                with replacing(self._path) as file:
                    file.write(data)
            else:
                self._path.unlink(missing_ok=True)
            self.problem = ""
        except OSError as problem:
            self._report(
                f"cannot write {self._form.what} to {self._path.parent}: {problem.strerror}; a "
                "restart of the mapper loses them"
            )

    def _report(self, problem: str) -> None:
        self.problem = problem
        LOG.error("%s", problem)
