"""The world that the content of a map folder is of: map, found objects and places.

Poses of another world are in another frame of reference, and so may be those of another life of the
robot's driver. What the folder holds of such a world is set aside whole.
"""
# Talks: logs what is damaged.
# Touches files: the world, and what is set aside.

from __future__ import annotations

import logging
import re
import zlib
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from itertools import count
from pathlib import Path

from onemap_mapper.places import keeper
from onemap_mapper.storage import objects
from onemap_mapper.storage.checkpoints import all_of
from onemap_mapper.storage.kept import witness
from onemap_shared.atomic_file import make_folder, move, replacing

LOG = logging.getLogger("onemap.mapper")

WORLD_FILE = "world.txt"
ASIDE = "other_worlds"  # inside the map folder
MAX_WORLD_CHARS = 400
CHECKSUM = "crc32 "  # begins the first line, before 8 digits; files of earlier releases have none
# Frames in a row that say the same new thing of themselves, before anything is set aside or dropped
# for it: under 1 s at 4 Hz. One whose header is damaged says something else than the next.
CONFIRMING_FRAMES = 3
ODOMETRY = re.compile(
    r".*/frame (.*/)?odom\w*"
)  # as the ROS 2 adapter names a frame like odom, REP 105


@dataclass(frozen=True, slots=True)
class World:
    """What poses are in.

    name: a robot's namespace, and what its frames name; empty: not known, as of earlier releases.
    driver: instance of the process that drove the robot; empty: not known.
    """

    name: str = ""
    driver: str = ""

    @property
    def begins_anew(self) -> bool:
        """Whether its frame of reference begins where the odometry did, with each start."""
        return ODOMETRY.fullmatch(self.name) is not None


class WorldChange(Enum):
    """What a frame's world is to the folder: that of its content, perhaps of one that waits for
    it, or another one, which some frames have to name in a row."""

    SAME = "same"
    CLAIMED = "claimed"
    GOES_ON = "goes on"
    OTHER = "other"


class Claim:
    """What frames say of themselves that differs from before, and how many in a row."""

    def __init__(self) -> None:
        self._said, self._count = "", 0

    def confirmed(self, said: str) -> bool:
        """Whether enough frames in a row say this, with the present one."""
        self._count = self._count + 1 if said == self._said else 1
        self._said = said
        return self._count >= CONFIRMING_FRAMES

    def withdraw(self) -> None:
        """A frame says what those before did."""
        self._count = 0


class FolderWorld:
    """The world of what a map folder holds.

    waits: the map goes with the robot's driver, and no frame has said who drives. resume: as
    ``MapperConfig.resume``.
    """

    def __init__(self, folder: Path, resume: bool | None) -> None:
        self._folder, self._resume = folder, resume
        self._here = _read(folder)
        self._claim, self._before = Claim(), ""  # before: name of what a loaded map has replaced
        self.waits = self._goes_with_driver(self._here)

    def change(self, name: str, driver: str) -> tuple[World, WorldChange]:
        """The world of a frame, and what it is to the folder. driver: empty: not known."""
        was = self._here
        here = World(name, driver or was.driver)
        new_driver = driver != was.driver if driver and was.driver else self.waits
        if here == was and not self.waits:
            self._claim.withdraw()
            return here, WorldChange.SAME
        known = was.name or self._before
        if known not in ("", name) and not self._claim.confirmed(name):
            return here, WorldChange.CLAIMED
        if was.name not in ("", name) or (new_driver and self._goes_with_driver(here)):
            return here, WorldChange.OTHER
        return here, WorldChange.GOES_ON

    def enter(self, here: World) -> None:
        """What the folder holds is of this world from now on. Raises OSError."""
        said = f"{here.name}\n{here.driver}".encode()
        with replacing(self._folder / WORLD_FILE) as file:
            file.write(f"{CHECKSUM}{zlib.crc32(said):08x}\n".encode() + said)
        self._here, self.waits = here, False

    def adopt(self) -> None:
        """What the folder holds is of whatever world the next frames are."""
        self._before = self._here.name or self._before
        self._here, self.waits = World(), False

    def why_left(self, here: World) -> str:
        """Why what the folder holds is not of this world."""
        if self._here.name in ("", here.name):
            return "the robot's driver was started anew, and the frame of its poses with it"
        before = self._here.name
        return f"the map was of another world ({before}) than the robot's frames ({here.name})"

    def _goes_with_driver(self, world: World) -> bool:
        """Whether a map of this world is one of a single life of the robot's driver."""
        return world.begins_anew if self._resume is None else not self._resume


def _read(folder: Path) -> World:
    """The world in its file. One that is gone or damaged is that of the next frames: to set zones
    aside for it would let robots drive where they may not."""
    path = folder / WORLD_FILE
    try:
        kept = path.read_bytes()
    except FileNotFoundError:
        return World()
    except OSError as problem:
        LOG.error("%s cannot be read (%s): the map is of the next frames' world", path, problem)
        return World()
    first, _, said = kept.partition(b"\n")
    if not first.startswith(CHECKSUM.encode()):
        said = kept  # of an earlier release
    elif first.decode(errors="replace") != f"{CHECKSUM}{zlib.crc32(said):08x}":
        said = b""
    name, _, driver = said.decode(errors="replace")[:MAX_WORLD_CHARS].partition("\n")
    if "/" not in name:  # which follows the namespace
        LOG.error("%s is damaged: the map is of the next frames' world", path)
        return World()
    return World(name, driver)


def set_aside(folder: Path) -> Path | None:
    """Move what the folder holds of a world into a new folder in it, which is returned.

    None if there is nothing. Raises OSError; what was not moved then is in the next call.
    """
    places = folder / keeper.FORM.file_name
    files = (folder / objects.FORM.file_name, witness(places), places)
    kept = [*all_of(folder), *filter(Path.exists, files)]
    if not kept:
        return None
    aside = next(path for number in count(1) if not (path := folder / ASIDE / str(number)).exists())
    make_folder(aside)
    try:
        for path in kept:
            move(path, aside / path.name)
        if (world := folder / WORLD_FILE).exists():  # last: it says whose the others are
            move(world, aside / WORLD_FILE)
    except OSError:
        with suppress(OSError):  # what was moved stays there
            aside.rmdir()
        raise
    return aside
