"""What is kept beside the map in a file of its own, written with every change."""
# Talks: logs; changes come from several threads.
# Touches files: what is kept.

from __future__ import annotations

import logging
import zlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Generic, TypeVar

from onemap_shared.atomic_file import move, remove, replacing, sync
from onemap_shared.clock import Clock
from onemap_shared.transport import RequestRejected

LOG = logging.getLogger("onemap.mapper")
M = TypeVar("M")

# Before the bytes, with their CRC-32: a flipped bit may leave a zone that can be read elsewhere.
# Files of earlier releases begin otherwise, and are read without a checksum.
MARK, CHECKSUM_BYTES = b"\xc1onemap1", 4


@dataclass(frozen=True, slots=True)
class Form(Generic[M]):
    """What is kept, in words; its file; its bytes, which are empty where no file is needed.

    from_bytes: raises ValueError for damaged ones. file_name: without the suffix of a map, so that
    it is not listed as one. confirm: what a person does before a file that cannot be read counts as
    nothing; empty: it does at once. version: of a value, larger with each change, which is written
    into a second file too: so a file that is gone, or older than what was last kept, is missed.
    """

    what: str
    file_name: str
    nothing: M
    to_bytes: Callable[[M], bytes]
    from_bytes: Callable[[bytes], M]
    confirm: str = ""
    version: Callable[[M], int] | None = None
    after: Callable[[M, M], M] | None = None  # the first, of a version after that of the second


class Kept(Generic[M]):
    """A value that outlives a crash of the mapper.

    problem: why it was lost or cannot be written, in one sentence; else empty. unreadable: why
    there is no value, which is not the same as nothing; else empty. ``announce`` is called after
    every change, without the lock.
    """

    def __init__(
        self,
        folder: Path,
        form: Form[M],
        announce: Callable[[], None],
        clock: Clock,
        *,
        expected: bool = False,
    ) -> None:
        """expected: something else says that there was a file; one that is gone cannot be read."""
        self._expected = expected
        self._path, self._form, self._announce = folder / form.file_name, form, announce
        self._lock = clock.lock()  # changing value and file is read, compute, write
        self.problem = self.unreadable = ""
        self._value = self._read()

    @property
    def value(self) -> M:
        """What is kept. Raises ``RequestRejected`` if that cannot be read."""
        if self._value is None:
            raise RequestRejected("unreadable", self.unreadable)
        return self._value

    def change(self, update: Callable[[M], M]) -> M:
        """Apply a change and write the file. Raises as ``exclusive``; then nothing changes."""
        return self.replace(lambda: update(self.value))

    def replace(self, make: Callable[[], M]) -> M:
        """Keep another value; a file that could not be read stays beside it."""
        with self.exclusive() as put:
            put(value := make())
        return value

    @contextmanager
    def exclusive(self) -> Iterator[Callable[[M], None]]:
        """Nobody else changes the value meanwhile, so that a change may rest on what was read.

        What is put is on disk and the value at once; it takes the place of the file and is
        announced at the end, and is taken back if the change raises. The lock of the map may be
        taken meanwhile, not before. ``put`` raises ``RequestRejected``, a change is refused whole,
        if the file cannot be written: call it before anything else is changed. If it cannot take
        its place at the end, nobody knows which of both is on disk: there is no value then, where
        a person is to confirm that there is none.
        """
        before = None
        try:
            with self._lock, ExitStack() as written:
                before = self._value

                def put(value: M) -> None:
                    if value is not before:
                        written.enter_context(self._written(value))
                        self._value = value

                try:
                    yield put
                except BaseException:
                    read, self._value = self._value, before
                    if self._form.after and before is not None and read not in (None, before):
                        self._value = self._form.after(before, read)  # its version was told
                    raise
        finally:
            if self._value is not before:
                self._announce()

    def _read(self) -> M | None:
        last = self._last_version()
        try:
            value = self._form.from_bytes(unsealed(self._path.read_bytes()))
            if self._form.version is not None and self._form.version(value) < last:
                raise ValueError("it is older than what was last kept")
            return value
        except FileNotFoundError as problem:
            if not (self._expected or last):
                return self._form.nothing
            why = problem.strerror
        except (OSError, ValueError) as problem:
            why = problem.strerror if isinstance(problem, OSError) else str(problem)
        if self._form.confirm:
            self.unreadable = self._unreadable(why)
            self._report(self.unreadable)
            return None
        try:
            aside = f"{self._path} is now {self._set_aside().name}"
        except OSError as problem:
            aside = f"{self._path} cannot be renamed either: {problem.strerror}"
        self._report(f"{self._form.what} are lost: {why}; {aside}")
        return self._form.nothing

    def _last_version(self) -> int:
        """As the second file says; 1, the first there is, if it is damaged; 0 without one."""
        try:
            return int(unsealed(witness(self._path).read_bytes()))
        except FileNotFoundError:
            return 0
        except (OSError, ValueError) as problem:
            LOG.error("%s cannot be read: %s", witness(self._path), problem)
            return 1

    def _set_aside(self) -> Path:
        """Rename the file to a name that is free; raises OSError."""
        names = (f"{self._path.name}.unreadable{number or ''}" for number in count())
        aside = next(p for name in names if not (p := self._path.with_name(name)).exists())
        move(self._path, aside)
        return aside

    @contextmanager
    def _written(self, value: M) -> Iterator[None]:
        """The value beside the file, whose place it takes at the end unless that raises."""
        data = self._form.to_bytes(value)
        with ExitStack() as new:
            with self._storing():
                files = {self._path: data} if data else {}
                if self._form.version is not None:  # takes its place after the file of the value
                    version = self._form.version(value)
                    files = {witness(self._path): b"%d" % version} | files
                for path, content in files.items():
                    file = new.enter_context(replacing(path))
                    file.write(sealed(content))
                    sync(path, file)  # so that a full disk shows before anything is changed
            yield
            with self._storing():
                try:
                    if self.unreadable and self._path.exists():
                        LOG.warning("%s is kept as %s", self._path, self._set_aside().name)
                    new.close()
                    if not data:
                        remove(self._path)
                except OSError as problem:
                    self._lose(problem)
                    raise
        self.problem = self.unreadable = ""

    def _lose(self, problem: OSError) -> None:
        """It is not known what is on disk."""
        if self._form.confirm:
            why = f"the last change may be on disk or not: {problem.strerror}"
            self._value, self.unreadable = None, self._unreadable(why)

    def _unreadable(self, why: object) -> str:
        return f"{self._form.what} in {self._path} cannot be read ({why}): {self._form.confirm}"

    @contextmanager
    def _storing(self) -> Iterator[None]:
        try:
            yield
        except OSError as problem:
            self._report(
                f"cannot write {self._form.what} to {self._path.parent}: {problem.strerror}"
            )
            raise RequestRejected("storage", self.problem) from problem

    def _report(self, problem: str) -> None:
        if problem != self.problem:
            LOG.error("%s", problem)
        self.problem = problem


def witness(path: Path) -> Path:
    """The file that tells the version of what is in the file ``path``."""
    return path.with_suffix(".version")


def sealed(data: bytes) -> bytes:
    """The bytes of a file, with their checksum."""
    return MARK + zlib.crc32(data).to_bytes(CHECKSUM_BYTES, "little") + data


def unsealed(file: bytes) -> bytes:
    """What ``sealed`` was given; raises ValueError if it is not that any more."""
    if not file.startswith(MARK):
        return file
    at = len(MARK) + CHECKSUM_BYTES
    if zlib.crc32(file[at:]) != int.from_bytes(file[len(MARK) : at], "little"):
        raise ValueError("its checksum is wrong: the file is damaged")
    return file[at:]
