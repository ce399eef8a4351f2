"""The disk of a virtual computer: slow, full, and after a cut of power without what was not synced.

What processes see is in memory at once, as in a page cache, and outlives their end. What is on disk
are the bytes of a file at its last ``sync``, and the names at the last one of any folder, as a
journal has it.
"""

from __future__ import annotations

import errno
import io
import os
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path, PosixPath
from typing import IO, Any, ClassVar

from onemap_tools.virtual.scheduler import EPOCH_NS, VirtualWorld

BYTES_PER_S = 200e6  # of a small computer's flash
SYNC_S = 0.002
WAITS_S = 0.001  # written without a pause: shorter ones would only be more switches


@dataclass(eq=False)
class _Content:
    """Of a file: as processes see it, and as it is on disk."""

    seen: bytearray = field(default_factory=bytearray)
    synced: bytes = b""
    modified_ns: int = 0


_Names = dict[str, "_Content | None"]


class VirtualDisk:
    """Implements ``atomic_file.Disk``. slower: times as slow; full: nothing more is written."""

    def __init__(self, world: VirtualWorld, name: str) -> None:
        self.world, self.slower, self.full = world, 1.0, False
        self._rng = random.Random(f"{world.seed} disk of {name}")
        self._seen: dict[str, _Content] = {}
        self._synced: dict[str, _Content] = {}
        self._changes: list[_Names] = []  # since the last sync, each whole or not at all
        self._folders = {"/"}
        self._path: Callable[[str], Path] = type(
            f"PathOn{name.title()}", (VirtualPath,), {"disk": self}
        )
        self.root = self._path("/")

    def sync(self, file: IO[bytes]) -> None:
        """See ``Disk``."""
        assert isinstance(file, VirtualFile)
        self._wait(SYNC_S)
        file.content.synced = bytes(file.content.seen)

    def sync_folder(self, folder: Path) -> None:  # noqa: ARG002
        """See ``Disk``; a journal has the names of all folders."""
        self._wait(SYNC_S)
        self._synced = dict(self._seen)
        self._changes.clear()

    def lose_power(self) -> None:
        """Keep what is on disk: names up to some change, and files that are torn where they were
        not synced."""
        for change in self._changes[: self._rng.randint(0, len(self._changes))]:
            _apply(self._synced, change)
        self._changes.clear()
        self._seen = dict(self._synced)
        for content in dict.fromkeys(self._seen.values()):
            if content.seen != content.synced:
                content.seen = self._torn(content)
                content.synced = bytes(content.seen)

    def damage(self, name: str, keep: float) -> bool:
        """Cut a file off after this share of its bytes, as a bad sector does; False without it."""
        paths = sorted(path for path in self._seen if fnmatchcase(path, f"*/{name}"))
        for path in paths:
            content = self._seen[path]
            del content.seen[int(len(content.seen) * keep) :]
            content.synced = bytes(content.seen)
        return bool(paths)

    def _torn(self, content: _Content) -> bytearray:
        seen = content.seen
        at = self._rng.randint(0, len(seen))
        return seen[:at] if self._rng.random() < 0.5 else seen[:at] + content.synced[at:]

    def _wait(self, seconds: float) -> None:
        self.world.pass_by()
        if self.world.current is not None and seconds * self.slower >= WAITS_S:
            self.world.wait(seconds * self.slower)

    # What paths and files ask for.

    def content(self, path: Path) -> _Content:
        """Of the file with this name; raises FileNotFoundError."""
        try:
            return self._seen[str(path)]
        except KeyError:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path)) from None

    def change(self, names: _Names) -> None:
        """Give files names; None: nothing has it."""
        self.world.pass_by()
        _apply(self._seen, names)
        self._changes.append(names)

    def read(self, content: _Content, at: int, nbytes: int) -> bytearray:
        """Bytes of a file."""
        self._wait(nbytes / BYTES_PER_S)
        return content.seen[at : at + nbytes]

    def room(self, nbytes: int) -> None:
        """Wait while so many bytes are written; raises OSError on a full disk."""
        self._wait(nbytes / BYTES_PER_S)
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def write(self, content: _Content, at: int, data: bytes) -> None:
        """Put bytes into a file. A process may end in their midst, and a full disk too."""
        middle = len(data) // 2
        content.modified_ns = EPOCH_NS + self.world.now_ns
        self.world.pass_by()
        content.seen[at : at + middle] = data[:middle]
        self.room(len(data))
        content.seen[at + middle : at + len(data)] = data[middle:]

    def names(self, folder: Path) -> Iterator[Path]:
        """All files in a folder."""
        paths = (self._path(name) for name in sorted(self._seen))
        return (path for path in paths if path.parent == folder)

    def add_folder(self, folder: Path) -> None:
        """Make a folder, which is on disk at once."""
        self._folders.add(str(folder))

    def is_folder(self, path: Path) -> bool:
        """Whether there is such a folder."""
        return str(path) in self._folders


def _apply(names: dict[str, _Content], change: _Names) -> None:
    for name, content in change.items():
        if content is None:
            names.pop(name, None)
        else:
            names[name] = content


class VirtualPath(PosixPath):
    """A path on a virtual disk, each of which has a class of its own."""

    disk: ClassVar[VirtualDisk]

    def open(self, mode: str = "r", *_: Any, **__: Any) -> Any:
        """As that of ``Path``, of bytes."""
        if mode == "xb" and self.is_file():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(self))
        if mode not in ("rb", "xb", "a+b"):
            raise ValueError(f"files of a virtual disk are not opened as {mode}")
        if mode != "rb" and not self.is_file():
            self.disk.room(0)
            made = _Content(modified_ns=EPOCH_NS + self.disk.world.now_ns)
            self.disk.change({str(self): made})
        return VirtualFile(self.disk, self.disk.content(self), appends=mode == "a+b")

    def read_bytes(self) -> bytes:
        content = self.disk.content(self)
        return bytes(self.disk.read(content, 0, len(content.seen)))

    def read_text(self, encoding: str | None = None, errors: str | None = None, *_: Any) -> str:
        return self.read_bytes().decode(encoding or "utf-8", errors or "strict")

    def exists(self, **_: Any) -> bool:
        return self.is_file() or self.disk.is_folder(self)

    def is_file(self, **_: Any) -> bool:
        return str(self) in self.disk._seen

    def stat(self, **_: Any) -> os.stat_result:
        content = self.disk.content(self)
        size, seconds = len(content.seen), content.modified_ns // 10**9
        return os.stat_result(
            (0o100644, 0, 0, 1, 0, 0, size, seconds, seconds, seconds),
            {"st_mtime_ns": content.modified_ns},
        )

    def glob(self, pattern: str, **_: Any) -> Iterator[Path]:  # type: ignore[override]
        return (path for path in self.disk.names(self) if fnmatchcase(path.name, pattern))

    def unlink(self, missing_ok: bool = False) -> None:
        self.disk.world.pass_by()
        if self.is_file():
            self.disk.change({str(self): None})
        elif not missing_ok:
            self.disk.content(self)

    def rename(self, target: Any) -> Any:
        self.disk.change({str(self): None, str(target): self.disk.content(self)})
        return target

    def replace(self, target: Any) -> Any:
        return self.rename(target)

    def mkdir(self, *_: Any, **__: Any) -> None:
        self.disk.add_folder(self)

    def rmdir(self) -> None:
        self.disk.world.pass_by()


class VirtualFile(io.RawIOBase):
    """An open file; every write is seen by others at once."""

    def __init__(self, disk: VirtualDisk, content: _Content, *, appends: bool) -> None:
        self._disk, self.content, self._appends, self._at = disk, content, appends, 0

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        begins = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: len(self.content.seen)}
        self._at = begins[whence] + offset
        return self._at

    def tell(self) -> int:
        return self._at

    def readinto(self, buffer: Any) -> int:
        data = self._disk.read(self.content, self._at, len(buffer))
        buffer[: len(data)] = data
        self._at += len(data)
        return len(data)

    def write(self, data: Any) -> int:
        written = bytes(data)
        if self._appends:
            self._at = len(self.content.seen)
        self._disk.write(self.content, self._at, written)
        self._at += len(written)
        return len(written)

    def truncate(self, size: int | None = None) -> int:
        size = self._at if size is None else size
        self._disk.world.pass_by()
        del self.content.seen[size:]
        return size
