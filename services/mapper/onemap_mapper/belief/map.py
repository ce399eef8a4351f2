"""The belief map: per cell a fused feature with its confidence, and the occupancy.

``frame.update.compute_update`` computes a frame's update without the map;
``BeliefMap.fuse`` fuses it. Only the frame's cells are written.

What is kept of a cell lies in layers by rows of the map's tiles, and in the store by slots; its
feature is on the device of the map.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_mapper.belief.cells import BesideFeature, CellStore, FeatureShare
from onemap_mapper.belief.tiles import NO_ROW, ChangeLog, MapTooLarge, TileIndex, TileLayer
from onemap_mapper.belief.version import NO_FRAMES, NO_SLOT, FrameHistory, MapVersion
from onemap_mapper.belief.view_log import ViewLog
from onemap_mapper.frame.update import FrameUpdate
from onemap_mapper.occupancy.evidence import HIT, OccupancyLayers, OccupancyUpdate, cells_within
from onemap_mapper.occupancy.offset import MIN_ON_FREE, REACH_CELLS, offset_cells
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F64, I64
from onemap_shared.grid import GridSpec, world_cells
from onemap_shared.messages import Occupancy

# Around the camera's first position, which counts as free: the robot stands there, its camera does
# not see that floor, and unknown is not free.
INITIALLY_FREE_RADIUS_M = 0.35
CHANGE_REACH_CELLS = 2  # 0.2 m: a patch of 27 pixels 3 m away, of 24 x 24 in an image


class FieldRejected(ValueError):
    """The field does not fit this map; the text says why in one sentence."""


class BeliefMap:
    """The map of one encoder; empty until the first update names the encoder.

    Robots that share it are numbered from 0. Not thread-safe: callers that share it between threads
    hold a lock.
    """

    def __init__(self, params: MapParams, *, first_revision: int = 0) -> None:
        self.params = params
        self.encoder_id = ""
        self.text_space = ""
        self.histories: dict[int, FrameHistory] = {}  # by robot
        self.frames_fused = 0
        self.revision = first_revision
        self.store = self._new_store(0)
        self.tiles = TileIndex(params)
        self.slots = TileLayer(np.int32, NO_SLOT)
        self.occupancy = OccupancyLayers(params)
        self.view_log = ViewLog()
        self.changes = ChangeLog()

    def history(self, robot: int = 0) -> FrameHistory:
        """What is remembered of a robot's frames."""
        return self.histories.get(robot, NO_FRAMES)

    @property
    def dimension(self) -> int:
        """Channels of a feature, 0 while the map is empty."""
        return self.store.dimension

    @property
    def grid(self) -> GridSpec:
        """The bounding box of all tiles."""
        return self.tiles.grid

    @property
    def memory_bytes(self) -> int:
        logs = self.view_log.nbytes + self.changes.nbytes
        held = self.store.nbytes + self.tiles.nbytes + logs
        return held + sum(layer.nbytes for layer in self._layers)

    @property
    def _layers(self) -> tuple[TileLayer, ...]:
        return (self.slots, *self.occupancy.layers)

    def fuse(self, update: FrameUpdate, *, robot: int = 0) -> None:
        """Fuse one frame of a robot. Raises ``FieldRejected`` before anything has changed."""
        self._check(update)
        history = self.history(robot)
        free = self._assumed_free(update, history.start_m)
        parts = (update.cells, update.occupancy.cells, free)
        rows, driving, floor = np.split(
            self.grow(np.concatenate(parts)), np.cumsum([len(part) for part in parts[:-1]])
        )
        if self.dimension == 0:
            self.set_encoder(update.encoder_id, update.text_space, update.features.shape[1])
        self.revision += 1
        offset_m = self._offset_m(update.occupancy, driving)
        self._doubt_beside(self.fuse_occupancy(update.occupancy, driving))
        slots = self.slots_at(rows, update.cells)
        views = replace(history.keyframes.views(update.T_map_camera), robot=robot)
        self.store.fuse(
            slots,
            update.features,
            update.confidence,
            revision=self.revision,
            views=views,
            beside=BesideFeature(update.heights, update.colours),
        )
        self.changes.mark(rows)
        self.view_log.record(
            rows,
            update.confidence,
            T_map_camera=update.T_map_camera,
            stamp_ns=update.stamp_ns,
            robot=robot,
        )
        self.assume_free(floor)
        self.frames_fused += 1
        self.histories[robot] = history.with_frame(update, views, offset_m)

    def _offset_m(self, frame: OccupancyUpdate, rows: I64) -> float:
        """How far beside the map what a frame shows stands, metres; 0 if it does not.

        rows (n,): those of its cells in the tiles.
        """
        standing = (frame.evidence[:, :-1] >= HIT).any(axis=1)
        settled = self.occupancy.settled.values
        if (standing & (settled[rows] == Occupancy.FREE)).sum() < MIN_ON_FREE:
            return 0.0
        cells = frame.cells[standing]
        first, last = cells.min(axis=0) - REACH_CELLS, cells.max(axis=0) + REACH_CELLS
        around = self.tiles.rows(first + np.argwhere(np.ones(last - first + 1, bool)))
        lasting = np.where(around == NO_ROW, np.uint8(Occupancy.UNKNOWN), settled[around])
        shift = offset_cells(cells - first, lasting.reshape(last - first + 1))
        return shift * self.params.cell_size_m

    def check_pose(self, T_map_camera: F64) -> None:
        """Raise ``MapTooLarge`` if the camera is where this map cannot reach.

        Checked before a frame's arrays are made. An empty map may begin within ``max_extent_m``
        of the origin: one wrong pose would otherwise refuse all right ones that follow.
        """
        camera_m, limit_m = T_map_camera[:3, 3], self.params.max_extent_m
        if self.tiles.count == 0 and np.abs(camera_m[:2]).max() > limit_m:
            raise MapTooLarge(
                f"the camera is at ({camera_m[0]:.0f}, {camera_m[1]:.0f}) m, further than "
                f"max_extent_m, {limit_m:g} m, from the origin: did the pose jump?"
            )
        self.tiles.check(world_cells(camera_m, self.params.cell_size_m)[None])

    def set_encoder(self, encoder_id: str, text_space: str, dimension: int) -> None:
        """Fix the encoder whose features the map holds; only while it is empty."""
        self.encoder_id, self.text_space = encoder_id, text_space
        self.store = self._new_store(dimension)

    def grow(self, cells: I64) -> I64:
        """Allocate tiles for world cells (n, 2); returns their rows (n,).

        Raises ``MapTooLarge`` before any change.
        """
        rows = self.tiles.allocate(cells)
        for layer in self._layers:
            layer.grow(self.tiles.count)
        self.view_log.grow(self.tiles.count)
        self.changes.grow(self.tiles.count)
        return rows

    def slots_at(self, rows: I64, cells: I64) -> I64:
        """Slots (n,) of distinct world cells (n, 2), at these rows, new where there were none."""
        slots: I64 = self.slots.values[rows].astype(np.int64)
        new = slots == NO_SLOT
        if new.any():
            slots[new] = self.store.new_slots(cells[new])
            self.slots.values[rows[new]] = slots[new]
        return slots

    def fuse_occupancy(self, frame: OccupancyUpdate, rows: I64) -> I64:
        """Add a frame's evidence to its cells, at these rows (n,) of the tiles.

        Returns the cells (k, 2) in which something stands now that did not, or the other way round.
        """
        different, changed = self.occupancy.add(rows, frame)
        self.changes.mark(rows[different])
        return frame.cells[changed]

    def _doubt_beside(self, changed: I64) -> None:
        """Let features at cells (k, 2) that changed, and beside them, count for little from now on.

        They are those of another thing; beside them, because a patch shows both sides of an edge.
        """
        if len(changed) == 0:
            return
        side = 2 * CHANGE_REACH_CELLS + 1
        reach = np.argwhere(np.ones((side, side), bool)) - CHANGE_REACH_CELLS
        rows = self.tiles.rows((changed[:, None] + reach).reshape(-1, 2))
        slots = self.slots.values[rows[rows != NO_ROW]]
        self.store.doubt(slots[slots != NO_SLOT], self.params.changed_confidence)

    def put_in(self, share: FeatureShare) -> None:
        """Fuse a share of the features. Raises ``MapTooLarge`` before any change."""
        rows = self.grow(share.cells)
        self.revision += 1
        slots = self.slots_at(rows, share.cells)
        self.store.put_in(slots, share, revision=self.revision)
        self.changes.mark(rows)

    def reset_searched(self, robot: int = 0) -> None:
        """Reset a robot's sigma_E, as its search begins; features and their variance stay."""
        self.revision += 1
        self.histories[robot] = self.history(robot).of_new_search()
        self.store.reset_searched(robot)
        self.changes.mark_everything()

    def version(self) -> MapVersion:
        """A copy of this revision, without its features."""
        shared = self.shared_version()
        return replace(
            shared,
            tiles=shared.tiles.copy(),
            slots=shared.slots.copy(),
            occupancy=shared.occupancy.copy(),
            assumed=shared.assumed.copy(),
            clear=shared.clear.copy(),
            heights=shared.heights.copy(),
            colours=shared.colours.copy(),
            view_log=shared.view_log.copy(),
            histories=self.histories.copy(),
        )

    def shared_version(self) -> MapVersion:
        """This revision for as long as nothing changes: it shares the map's memory."""
        return MapVersion(
            revision=self.revision,
            histories=self.histories,
            encoder_id=self.encoder_id,
            explored_variance=self.params.explored_variance,
            tiles=self.tiles,
            slots=self.slots.values,
            occupancy=self.occupancy.states.values,
            assumed=self.occupancy.assumed.values,
            clear=self.occupancy.clear.values,
            drops=self.occupancy.drops(),
            confidences=self.store.confidences(slice(0, self.store.count)),
            heights=self.store.heights,
            colours=self.store.colours,
            view_log=self.view_log,
        )

    def _new_store(self, dimension: int) -> CellStore:
        params = self.params
        return CellStore(
            dimension,
            device=params.torch_device,
            dtype=params.torch_dtype,
            compiled=params.compiled,
            max_prior=params.max_prior_confidence,
        )

    def _check(self, update: FrameUpdate) -> None:
        # Sums of what perception sends do not overflow, and one that is not finite makes them so.
        if not np.isfinite(float(update.features.sum()) + float(update.confidence.sum())):
            raise FieldRejected(
                "the frame's features or confidences are not finite: their cells would stay NaN; "
                "check perception's variance and encoder"
            )
        if self.dimension == 0:
            return
        ours = (self.encoder_id, self.text_space, self.dimension)
        theirs = (update.encoder_id, update.text_space, update.features.shape[1])
        if ours != theirs:
            raise FieldRejected(
                f"the map holds features of encoder {ours[0]} ({ours[1]}, {ours[2]} channels) but "
                f"the frame has {theirs[0]} ({theirs[1]}, {theirs[2]} channels): clear the map or "
                "restart perception with the map's encoder"
            )

    def _assumed_free(self, update: FrameUpdate, start_m: F64 | None) -> I64:
        """Cells (n, 2) that count as free though no camera sees their floor.

        Around the camera's first position, ``start_m``; and, while it is there, from there to the
        nearest floor in view: the floor between both is in no image.
        """
        radius_m, none = INITIALLY_FREE_RADIUS_M, np.zeros((0, 2), np.int64)
        first = start_m is None
        start_m = update.camera_m if start_m is None else start_m
        seen = update.occupancy
        if radius_m == 0 or np.linalg.norm(update.camera_m[:2] - start_m[:2]) > radius_m:
            return seen.cells[:0]
        disc = cells_within(start_m, radius_m, self.params.cell_size_m) if first else none
        return np.concatenate([disc, seen.cells[seen.blind]])

    def assume_free(self, rows: I64) -> None:
        """Take floor of cells for free, by rows (n,) of the tiles; no camera sees it."""
        if len(rows):
            self.changes.mark(rows[self.occupancy.assume(rows)])
