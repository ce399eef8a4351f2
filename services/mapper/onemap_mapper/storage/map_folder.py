"""The saved maps of a folder, on the bus: listed, deleted, merged into the map in use."""
# Talks: answers on the bus, and logs.
# Touches files: maps.

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.places.keeper import PlaceKeeper
from onemap_mapper.storage.map_file import SUFFIX, MapNotFound, map_path, read, read_header, require
from onemap_mapper.storage.objects import ObjectKeeper, ObjectMemory
from onemap_mapper.storage.planar_motion import PlanarMotion
from onemap_mapper.storage.snapshot import (
    EncoderMismatch,
    MapFileError,
    merge_into,
)
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.atomic_file import remove
from onemap_shared.transport import RequestRejected, Server


class QuotaExceeded(ValueError):
    """The saved maps would take more than they may; the text says what to do."""


def check_quota(path: Path, nbytes: int, quota_mb: int) -> None:
    """Raise ``QuotaExceeded`` if a file of about ``nbytes`` at ``path`` is too much.

    A file that it replaces does not count.
    """
    others = (each for each in path.parent.glob(f"*{SUFFIX}") if each != path)
    used = sum(_size(each) for each in others) + nbytes
    if used > quota_mb * 10**6:
        raise QuotaExceeded(
            f"the saved maps would take {used / 1e6:.0f} MB, more than map_quota_mb, {quota_mb}: "
            "delete one, GET /v1/maps lists them"
        )


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:  # deleted meanwhile
        return 0


def saved_maps(folder: Path) -> m.MapList:
    """The maps of ``folder``, newest first; a damaged one is listed with its problem."""
    found: list[tuple[int, Path]] = []
    for path in folder.glob(f"*{SUFFIX}"):
        with suppress(FileNotFoundError, MapFileError):  # deleted meanwhile; no name of a map
            if map_path(folder, path.name).is_file():
                found.append((-path.stat().st_mtime_ns, path))
    maps = []
    for _, path in sorted(found)[: m.MAX_LISTED_MAPS]:
        with suppress(FileNotFoundError):
            maps.append(describe(path))
    return m.MapList(tuple(maps), max(len(found) - m.MAX_LISTED_MAPS, 0))


def describe(path: Path) -> m.SavedMap:
    """What is known of a file without reading its arrays."""
    entry = path.stat()
    stem = path.name.removesuffix(SUFFIX)
    name = path.name if stem.endswith(SUFFIX) else stem  # "x" for x.npz, not "x.npz" for x.npz.npz
    try:
        header, cells = read_header(path)
        return m.SavedMap(
            name,
            entry.st_size,
            entry.st_mtime_ns,
            encoder_id=header.encoder_id,
            text_space=header.text_space,
            cell_size_m=header.cell_size_m,
            cells_observed=cells,
            frames_fused=header.frames_fused,
        )
    except ValueError as problem:  # of the file, or of a text that is too long for the message
        reason = str(problem)[: m.MAX_FILE_TEXT_CHARS]
        return m.SavedMap(name, entry.st_size, entry.st_mtime_ns, problem=reason)


LOG = logging.getLogger("onemap.mapper")

Edit = Callable[[Callable[[BeliefMap], None]], m.MapSummary]


@contextmanager
def refusing(doing: str) -> Iterator[None]:
    """What goes wrong with a map's file, as a refusal that names what was being done."""
    try:
        yield
    except MapNotFound as problem:
        raise RequestRejected("unknown_map", str(problem)) from problem
    except EncoderMismatch as problem:
        raise RequestRejected("encoder_mismatch", str(problem)) from problem
    except QuotaExceeded as problem:
        raise RequestRejected("storage", str(problem)) from problem
    except OSError as problem:
        raise RequestRejected("storage", f"cannot {doing}: {problem.strerror}") from problem


class SavedMaps:
    """Answers about the files of the map folder.

    ``edit`` applies a change to the map in use, with its lock held, and announces it.
    """

    def __init__(
        self,
        bus: Server,
        config: MapperConfig,
        objects: ObjectKeeper,
        places: PlaceKeeper,
        edit: Edit,
    ) -> None:
        self._config, self._edit = config, edit
        self._objects, self._places = objects, places
        bus.serve(keys.MAP_LIST, self.list_maps)
        bus.serve(keys.MAP_DELETE, self.delete_map)
        bus.serve(keys.MAP_MERGE, self.merge)

    def list_maps(self, request: m.MapListRequest) -> m.MapList:
        """The saved maps, or the one of the request's name."""
        if not request.name:
            return saved_maps(self._config.map_folder)
        with refusing(f"read map {request.name}"):
            return m.MapList((describe(self._existing(request.name)),))

    def delete_map(self, request: m.MapFile) -> m.SavedMap:
        """Delete a saved map; the map in memory stays."""
        with refusing(f"delete map {request.name}"):
            path = self._existing(request.name)
            deleted = describe(path)
            remove(path)
        LOG.info("deleted map %s", request.name)
        return deleted

    def _existing(self, name: str) -> Path:
        path = map_path(self._config.map_folder, name)
        require(path)
        return path

    def merge(self, request: m.MapMerge) -> m.MapSummary:
        """Fuse a saved map into the map in use; a rejected one changes nothing.

        Places and objects that come meanwhile are named, and kept, in the merged map. Map, places
        and objects change in one announced revision: zones hold when their floor is known.
        """
        path = map_path(self._config.map_folder, request.name)
        moved = PlanarMotion(request.yaw_rad, request.x_m, request.y_m)
        with refusing(f"read {path}"):
            content = read(path, max_cells=self._config.map.max_cells)
            size = path.stat().st_size
            with (
                self._objects.kept.exclusive() as put_objects,
                self._places.kept.exclusive() as put_places,
            ):
                places, stayed = self._places.kept.value.merged(content.places, moved)
                ours = self._objects.memory
                objects = ours.changed_to(merged_objects(ours, content.objects, moved))

                def merged(belief: BeliefMap) -> None:
                    put_places(places)
                    put_objects(objects)
                    merge_into(belief, content, moved)

                summary = self._edit(merged)
        LOG.info("merged %s into the map: %d cells", path, summary.cells_observed)
        if stayed:
            LOG.info("places that stayed as they were: %s", ", ".join(stayed))
        return replace(summary, path=str(path), file_bytes=size, places_stayed=stayed)


def merged_objects(ours: ObjectMemory, theirs: ObjectMemory, moved: PlanarMotion) -> ObjectMemory:
    """Our found objects and those of theirs that are none of ours, at their places in our frame."""
    objects = list(ours.objects)
    for entry in theirs.objects:
        kept, known = _moved_object(entry.kept, moved), {each.kept.object_id for each in objects}
        # An id that is known: both maps began from one file.
        if ours.same_object(kept) is None and kept.object_id not in known:
            objects.append(m.PicturedObject(kept, entry.picture))
    objects.sort(key=lambda entry: entry.kept.last_seen_ns)
    return replace(ours, objects=tuple(objects)).limited()


def _moved_object(kept: m.KeptObject, moved: PlanarMotion) -> m.KeptObject:
    """The object at its place in the other frame; its extent is the box around the moved one."""
    x_min, y_min, x_max, y_max = kept.extent_m
    corners = moved.apply(np.array([(x, y) for x in (x_min, x_max) for y in (y_min, y_max)]))
    (low_x, low_y), (high_x, high_y) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    ((x, y),) = moved.apply(np.array([kept.position_m[:2]])).tolist()
    extent_m = (low_x, low_y, high_x, high_y)
    return replace(kept, position_m=(x, y, kept.position_m[2]), extent_m=extent_m)
