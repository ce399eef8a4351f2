"""The saved maps on the bus: listed, deleted, merged into the map in use."""
# Talks: answers on the bus, and logs.

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

from onemap_mapper import map_folder
from onemap_mapper.belief import merge
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.submaps import PlanarCorrection
from onemap_mapper.config import MapperConfig
from onemap_mapper.object_keeper import ObjectKeeper
from onemap_mapper.storage import map_file, snapshot
from onemap_shared import keys
from onemap_shared.messages import (
    MapFile,
    MapList,
    MapListRequest,
    MapMerge,
    MapSummary,
    SavedMap,
)
from onemap_shared.transport import RequestRejected, Server

LOG = logging.getLogger("onemap.mapper")

Edit = Callable[[Callable[[BeliefMap], None]], MapSummary]


class SavedMaps:
    """Answers about the files of the map folder.

    ``edit`` applies a change to the map in use, with its lock held, and announces it.
    """

    def __init__(
        self, bus: Server, config: MapperConfig, objects: ObjectKeeper, edit: Edit
    ) -> None:
        self._config, self._objects, self._edit = config, objects, edit
        bus.serve(keys.MAP_LIST, self.list_maps)
        bus.serve(keys.MAP_DELETE, self.delete_map)
        bus.serve(keys.MAP_MERGE, self.merge)

    def list_maps(self, request: MapListRequest) -> MapList:
        """The saved maps, or the one of the request's name."""
        if not request.name:
            return map_folder.saved_maps(self._config.map_folder)
        try:
            return MapList((map_folder.saved_map(self._config.map_folder, request.name),))
        except map_file.MapNotFound as problem:
            raise RequestRejected("unknown_map", str(problem)) from problem

    def delete_map(self, request: MapFile) -> SavedMap:
        """Delete a saved map; the map in memory stays."""
        try:
            deleted = map_folder.delete(self._config.map_folder, request.name)
        except map_file.MapNotFound as problem:
            raise RequestRejected("unknown_map", str(problem)) from problem
        except OSError as problem:
            raise RequestRejected(
                "storage", f"cannot delete map {request.name}: {problem.strerror}"
            ) from problem
        LOG.info("deleted map %s", request.name)
        return deleted

    def merge(self, request: MapMerge) -> MapSummary:
        """Fuse a saved map into the map in use; a rejected one changes nothing."""
        path = map_file.map_path(self._config.map_folder, request.name)
        moved = PlanarCorrection(request.yaw_rad, request.x_m, request.y_m)
        try:
            content = map_file.read(path, max_cells=self._config.map.max_cells)
            size = path.stat().st_size
            summary = self._edit(lambda belief: merge.merge_into(belief, content, moved))
        except map_file.MapNotFound as problem:
            raise RequestRejected("unknown_map", str(problem)) from problem
        except snapshot.EncoderMismatch as problem:
            raise RequestRejected("encoder_mismatch", str(problem)) from problem
        except OSError as problem:
            raise RequestRejected("storage", f"cannot read {path}: {problem.strerror}") from problem
        ours = self._objects.memory
        self._objects.replace(merge.merged_objects(ours, content.objects, moved))
        LOG.info("merged %s into the map: %d cells", path, summary.cells_observed)
        return replace(summary, path=str(path), file_bytes=size)
