"""The mapper on the bus: fuses the newest field, answers requests about the map.

One lock protects the map. A frame's update is computed without it, only fusing holds it; text
embeddings are fetched without it, and ``query.scores`` says how texts are scored without it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import torch

from onemap_mapper.belief.map import BeliefMap, FieldRejected
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.camera_check import diagnosis_due
from onemap_mapper.frame.update import FrameUpdate, compute_update
from onemap_mapper.places.keeper import PlaceKeeper
from onemap_mapper.places.rooms import Rooms
from onemap_mapper.query.replies import (
    judged,
    search_view,
    similarity_reply,
    summary_of,
)
from onemap_mapper.query.similarity import TextQuery
from onemap_mapper.query.whereabouts import LANDMARKS, Knowledge, where_found
from onemap_mapper.robots import SERVICE, AllRobots, MapRobot, buses_of
from onemap_mapper.session import MapSession
from onemap_mapper.storage import map_file
from onemap_mapper.storage.checkpoints import Checkpoints, resumed, sweep
from onemap_mapper.storage.map_file import LiveMap
from onemap_mapper.storage.map_folder import SavedMaps, check_quota, refusing
from onemap_mapper.storage.objects import NO_OBJECTS, ObjectKeeper, ObjectMemory
from onemap_mapper.storage.snapshot import restore
from onemap_mapper.storage.worlds import (
    CONFIRMING_FRAMES,
    Claim,
    FolderWorld,
    WorldChange,
    set_aside,
)
from onemap_mapper.warm_up import prepare, resolved_device
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.grid import GridTooLarge
from onemap_shared.runner import StartReport
from onemap_shared.transport import Bus, Health, RequestRejected

LOG = logging.getLogger("onemap.mapper")

NOTICE_S = 60.0  # for which the status says that a map was left; the log keeps it
# The other services share the cores, and torch's threads wait for each other at every step: on two
# cores under a load of seven, a 640 x 480 frame took 28 ms with one thread and 770 ms with two.
TORCH_THREADS = 1


class Mapper:
    """The worker: one map of one robot or of several, each on its bus, its caches and its files.

    compute: makes the update of a frame.
    """

    def __init__(
        self,
        buses: Sequence[Bus],
        config: MapperConfig,
        compute: Callable[..., FrameUpdate] = compute_update,
    ) -> None:
        self._config, self._clock, self._compute = config, buses[0].clock, compute
        self._lock = self._clock.lock()
        # One query at a time competes with fusing, in order of arrival; torch starts threads of
        # its own for every thread that calls it.
        self._scoring = self._clock.pool(1, "scoring")
        sweep(config.map_folder)
        self._world = FolderWorld(config.map_folder, config.resume)
        self._encoder = Claim()  # of another one than the resumed map's
        kept, places = (None, ()) if self._world.waits else resumed(config.map_folder, config.map)
        robots = len(buses)
        belief = kept or BeliefMap(config.map)
        self._session = MapSession(
            belief, self._lock, self._clock, robots, resumed=kept is not None
        )
        self._notice, self._notice_until_s = "", 0.0  # that a map was set aside or dropped
        self._live = LiveMap(self._lock, lambda: self._map)
        self._checkpoints = Checkpoints(
            config.map_folder, self._live, self._clock, lambda: self._places.for_checkpoint
        )
        self._arrived = self._clock.event()  # a field, of any robot
        self._steps = 0
        self._robots = tuple(
            MapRobot(number, bus, config.map.torch_device, self._arrived, self._space)
            for number, bus in enumerate(buses)
        )
        shared = AllRobots(self._robots)
        folder, height_m = config.map_folder, self._live.height_m
        self._objects = ObjectKeeper(
            shared, buses, folder, self._announce_kept, height_m, tell=self._told
        )
        self._places = PlaceKeeper(
            shared,
            folder,
            self._announce_kept,
            self._rooms,
            lambda: self._objects.memory,
            before=places,
        )
        for robot in self._robots:
            robot.bus.serve(keys.MAP_SIMILARITY, partial(self.similarity, robot))
            robot.bus.serve(keys.MAP_IMAGE_SIMILARITY, partial(self.image_similarity, robot))
            robot.bus.serve(keys.MAP_SEARCH_VIEW, partial(self.search_view, robot))
            robot.bus.serve(keys.MAP_VIEW_CHANGES, partial(self.view_changes, robot))
            robot.bus.serve(keys.MAP_SEARCH_RESET, partial(self.reset_searched, robot))
        shared.serve(keys.MAP_SAVE, self.save)
        shared.serve(keys.MAP_LOAD, self.load)
        SavedMaps(shared, config, self._objects, self._places, self._edit)
        shared.serve(keys.MAP_CLEAR, self.clear)
        if kept is not None or self._places.version:
            self._announce_kept()  # zones hold before the first frame

    def step(self, timeout_s: float) -> None:
        """Fuse the newest field of each robot, if any arrives within the timeout."""
        self._arrived.wait(timeout_s)
        self._arrived.clear()  # before they are taken, so that none is overlooked
        self._steps += 1
        for robot in self._robots:
            belief = self._map  # before the field is taken, see _fuse
            if (field := robot.take_field()) is not None:
                self._fuse(robot, field, belief)
            robot.beat(self._steps, partial(self._health, robot))
        self._checkpoints.poll(self._clock.monotonic_s())

    def health(self) -> Health:
        """Metrics of the map and of the first robot's frames, and the current problem."""
        return self._health(self._robots[0])

    def _health(self, robot: MapRobot) -> Health:
        with self._lock:
            now_s = self._clock.monotonic_s()
            metrics = {
                "frames_fused": float(self._map.frames_fused),
                "cells": float(self._map.store.count),
                "memory_bytes": float(self._map.memory_bytes),
            }
            metrics |= robot.metrics(self._map.history(robot.number), now_s)
            metrics["checkpoints"] = float(self._checkpoints.written)
            metrics["checkpoint_ms"] = self._checkpoints.write_ms
            problem = self._places.kept.problem or robot.telemetry.problem(now_s)
            problem = problem or self._objects.problem
            problem = problem or self._checkpoints.problem
            problem = problem or (self._notice if now_s < self._notice_until_s else "")
            ready = robot.telemetry.ready(now_s) and not self._places.kept.unreadable
        return Health(ready=ready, problem=problem, metrics=metrics)

    def close(self) -> None:
        """Answer no more queries; write the map, so that the next mapper resumes it."""
        self._scoring.shutdown(wait=False, cancel_futures=True)
        self._checkpoints.close()
        for robot in self._robots:
            robot.close(self._steps)

    def similarity(self, robot: MapRobot, request: m.SimilarityRequest) -> m.SimilarityReply:
        """Ranked regions for a text."""
        self._require_content()
        texts = (request.text, *request.negatives, *request.detail.anchors)
        queries = [robot.queries.of_text(text) for text in texts]
        return self._scoring.submit(self._answer, robot, request, queries).result()

    def image_similarity(
        self, robot: MapRobot, request: m.ImageSimilarityRequest
    ) -> m.SimilarityReply:
        """Ranked regions for what a picture shows; its scores are no probabilities."""
        self._require_content()
        queries = [robot.queries.of_image(request.image)]
        queries += [robot.queries.of_text(name) for name in request.query.detail.anchors]
        reply = self._scoring.submit(self._answer, robot, request.query, queries).result()
        return replace(reply, calibrated=False)

    def _answer(
        self, robot: MapRobot, request: m.SimilarityRequest, queries: Sequence[TextQuery]
    ) -> m.SimilarityReply:
        session = self._session
        landmarks = robot.queries.of_rivals(LANDMARKS)
        scored = session.scores.of([*queries, *landmarks], robot.number)
        if scored.version.count == 0:
            raise _empty()
        known = self._known()
        names = [each.text for each in landmarks]
        reply = similarity_reply(scored, request=request, known=known, landmarks=names)
        coverages = session.coverages[robot.number]
        coverage = coverages.coverage(scored.version, request.area_m, request.robot_xy_m)
        return judged(reply, request, coverage, scored, self._config.found_score)

    def _known(self) -> Knowledge:
        finds = tuple(each.kept for each in self._objects.memory.objects)
        return Knowledge(self._places.places(), finds)

    def _told(self, finds: Sequence[m.KeptObject]) -> Sequence[m.KeptObject]:
        """The finds with where they are; landmarks are those that were looked up before, so that
        nobody is waited for."""
        if not finds or self._map.store.count == 0:
            return finds
        landmarks = max((each.queries.kept(LANDMARKS) for each in self._robots), key=len)
        scored = self._session.scores.of(landmarks)
        return where_found(scored, finds, self._known())

    def search_view(self, robot: MapRobot, request: m.SearchViewRequest) -> m.SearchView:
        """The layers, with the similarity if a text was given and the map is not empty."""
        scored = self._session.scores.of(self._compared(robot, request), robot.number)
        negatives, colour = len(request.negatives), request.colour
        return search_view(scored, text=request.text, negatives=negatives, colour=colour)

    def view_changes(self, robot: MapRobot, request: m.ViewChangesRequest) -> m.ViewChanges:
        """What ``search_view`` replies, as the cells that changed since the caller's last view."""
        views = self._session.views
        return views.reply(request, self._compared(robot, request), robot.number)

    def _compared(
        self, robot: MapRobot, request: m.SearchViewRequest | m.ViewChangesRequest
    ) -> list[TextQuery]:
        """The queries of the text, its negatives and its rivals; none without a text or in an
        empty map."""
        if self._map.store.count == 0 or not request.text:
            return []
        sought = map(robot.queries.of_text, (request.text, *request.negatives))
        return [*sought, *robot.queries.of_rivals(request.rivals)]

    def reset_searched(self, robot: MapRobot, _request: m.SearchReset) -> m.MapSummary:
        """Reset sigma_E of one robot: its search begins, whose finds will lie near landmarks."""
        robot.queries.prefetch(LANDMARKS)
        with self._lock:
            self._map.reset_searched(robot.number)
            self._announce()
            return summary_of(self._map)

    def save(self, request: m.MapFile) -> m.MapSummary:
        """Write the map, with its found objects and places, to the configured folder."""
        path = map_file.map_path(self._config.map_folder, request.name)
        with self._lock:
            if self._map.dimension == 0:
                raise _empty()
            summary = summary_of(self._map)
        created, quota_mb = not path.exists(), self._config.map_quota_mb
        with refusing(f"write {path}"):
            size = self._live.write(
                path,
                objects=self._objects.memory,
                places=self._places.kept.value.places,
                accept=lambda nbytes: check_quota(path, nbytes, quota_mb),
            )
        if not size:  # cleared meanwhile
            raise _empty()
        LOG.info("saved %d cells to %s", summary.cells_observed, path)
        return replace(summary, path=str(path), file_bytes=size, created=created)

    def load(self, request: m.MapFile) -> m.MapSummary:
        """Replace the map, with its found objects and places, by one from the configured folder.

        A rejected file changes nothing.
        """
        path = map_file.map_path(self._config.map_folder, request.name)
        with self._lock:
            seen = (robot.encoder_seen for robot in self._robots if robot.encoder_seen)
            encoder_id = self._map.encoder_id or next(seen, "")
        params = self._config.map
        with refusing(f"read {path}"):
            content = map_file.read(path, max_cells=params.max_cells)
            restored = restore(content, params, encoder_id=encoder_id, first_revision=0)
            size = path.stat().st_size
        summary = replace(summary_of(restored), path=str(path), file_bytes=size)
        self._exchange(restored, content.places, content.objects, first=self._world.adopt)
        LOG.info("loaded %d cells from %s", summary.cells_observed, path)
        return summary

    def clear(self, _request: m.MapClear) -> m.MapSummary:
        """Start an empty map, without found objects and places."""
        cleared = self._exchange(BeliefMap(self._config.map))
        self._world.waits = False
        return cleared

    def _rooms(self) -> Rooms:
        """The rooms of the map; frames are fused while they are cut."""
        session = self._session
        return session.rooms.of(search_view(session.scores.of([]), text=""))

    def _fuse(self, robot: MapRobot, field: m.FeatureField, belief: BeliefMap) -> None:
        """Fuse a field into ``belief``, the map when it was taken.

        If another map has taken its place meanwhile, the field is dropped: it is of before.
        """
        started_s = self._clock.monotonic_s()
        try:
            belief = self._of_world(robot, field, belief)
            history = belief.history(robot.number)
            if robot.is_late(field, history):
                return
            belief = self._without_resumed_of_another(belief, field.encoder_id)
            if len(self._robots) > 1 and (problem := robot.origin_problem(field, history)):
                raise FieldRejected(problem)
            belief.check_pose(field.T_map_camera)
            diagnose = diagnosis_due(field.stamp_ns, robot.telemetry.diagnosed_ns)
            update = self._compute(field, belief.params, diagnose=diagnose)
            self._fuse_update(robot, update, belief, started_s)
        except (FieldRejected, GridTooLarge) as problem:
            robot.telemetry.record_rejected(str(problem))
            LOG.warning("frame %d rejected: %s", field.sequence, problem)

    def _of_world(self, robot: MapRobot, field: m.FeatureField, belief: BeliefMap) -> BeliefMap:
        """The map of the world that a field is of: an empty one if ours is of another.

        Raises ``FieldRejected`` if another robot of a shared map is in another world, or if what is
        of another one cannot be set aside.
        """
        first, folder = self._robots[0], self._config.map_folder
        name = f"{first.bus.namespace}/{field.world}"
        here, change = self._world.change(name, first.driver)
        if change is WorldChange.SAME:
            return belief
        others = {other.world for other in self._robots} - {None, field.world}
        if others:
            raise FieldRejected(
                f"robot {robot.bus.namespace} is in world {field.world!r}, but others of its map "
                f"are in {', '.join(map(repr, others))}"
            )
        if change is WorldChange.CLAIMED:
            raise FieldRejected(
                f"it names world {field.world!r}, another one than the frames before: "
                f"{CONFIRMING_FRAMES} in a row have to"
            )
        try:
            if change is WorldChange.OTHER:
                self._leave(belief, self._world.why_left(here))
            elif self._world.waits and (kept := resumed(folder, self._config.map)[0]) is not None:
                self._take_up(kept)
            self._world.enter(here)
        except OSError as problem:
            raise FieldRejected(
                f"cannot set aside in {folder} what belongs to another world: {problem.strerror}"
            ) from problem
        except RequestRejected as problem:
            raise FieldRejected(str(problem)) from problem
        return self._map

    def _leave(self, belief: BeliefMap, why: str) -> None:
        """Begin with nothing; what there was is set aside whole. Raises OSError."""
        aside: Path | None = None

        def moved() -> None:
            nonlocal aside
            if self._map is not belief:
                raise FieldRejected("another map has taken the place of its own")
            aside = set_aside(self._config.map_folder)

        self._checkpoints.flush()  # so that none of it is lost
        self._exchange(BeliefMap(self._config.map), first=moved)
        if aside is None:
            return
        self._notify(
            f"{why}: the map is set aside, with what was found and named there, in {aside}, and a "
            "new one begins"
        )

    def _notify(self, notice: str) -> None:
        """Log that a map was left, and say it in the status for a while."""
        self._notice, self._notice_until_s = notice, self._clock.monotonic_s() + NOTICE_S
        LOG.warning("%s", notice)

    def _take_up(self, kept: BeliefMap) -> None:
        """Go on with the map of a checkpoint, whose places and objects are those in use."""
        with self._lock:
            kept.revision = self._map.revision + 1
            self._replace(kept)
            self._session.resumed = True

    def _exchange(
        self,
        belief: BeliefMap,
        places: tuple[m.Place, ...] = (),
        objects: ObjectMemory = NO_OBJECTS,
        *,
        first: Callable[[], None] = lambda: None,
    ) -> m.MapSummary:
        """Another map with its places and found objects, in one announced revision.

        first: called with all locks held; what it raises leaves everything as it was, as does
        ``RequestRejected``, for what cannot be written.
        """
        with (
            self._objects.kept.exclusive() as put_objects,
            self._places.kept.exclusive() as put_places,
            self._lock,
        ):
            put_places(self._places.exchanged(places))
            put_objects(self._objects.memory.changed_to(objects))
            first()
            belief.revision = self._map.revision + 1
            self._replace(belief)
            self._checkpoints.replaced(due=belief.dimension > 0)
            return summary_of(belief)

    def _without_resumed_of_another(self, belief: BeliefMap, encoder_id: str) -> BeliefMap:
        """An empty map if the resumed one is of another encoder: perception was changed.

        Until enough frames say so the map stays, and refuses them.
        """
        with self._lock:
            if (
                not self._session.resumed
                or self._map is not belief
                or encoder_id == belief.encoder_id
                or not self._encoder.confirmed(encoder_id)
            ):
                return belief
            self._notify(
                f"the map of before is of encoder {belief.encoder_id}, but frames are of "
                f"{encoder_id}: it is dropped, and a new one begins"
            )
            self._replace(BeliefMap(self._config.map, first_revision=belief.revision + 1))
            self._checkpoints.replaced(due=False)
            return self._map

    def _fuse_update(
        self, robot: MapRobot, update: FrameUpdate, belief: BeliefMap, started_s: float
    ) -> None:
        with self._lock:
            if self._map is not belief:
                return
            belief.fuse(update, robot=robot.number)
            self._session.resumed = False
            robot.camera = (update.camera,)
            now_s = self._clock.monotonic_s()
            robot.telemetry.record_fused(
                now_s=now_s,
                update_ms=(now_s - started_s) * 1e3,
                stamp_ns=update.stamp_ns,
                depth=update.depth,
            )
            self._announce()

    def _replace(self, belief: BeliefMap) -> None:
        """Exchange the map and everything derived from it; the caller holds the lock."""
        self._session = MapSession(belief, self._lock, self._clock, len(self._robots))
        for robot in self._robots:
            robot.telemetry.reset_floor()  # the map may have another frame
        self._announce()

    def _announce(self) -> None:
        """Publish the revision; the caller holds the lock, so that revisions leave in order."""
        for robot in self._robots:
            robot.announce(self._session, self._objects.memory.version, self._places.version)

    def _announce_kept(self) -> None:
        with self._lock:
            self._announce()

    def _edit(self, change: Callable[[BeliefMap], None]) -> m.MapSummary:
        """Change the map in use; what the change raises leaves it as it was."""
        with self._lock:
            change(self._map)
            self._checkpoints.hurry()
            self._announce()
            return summary_of(self._map)

    def _require_content(self) -> None:
        if self._map.store.count == 0:
            raise _empty()

    def _space(self) -> tuple[str, int]:
        with self._lock:
            return self._map.text_space, self._map.dimension

    @property
    def _map(self) -> BeliefMap:
        return self._session.belief


def _empty() -> RequestRejected:
    return RequestRejected("empty_map", "the map is empty: nothing has been seen yet")


def build(bus: Bus, config: MapperConfig, start: StartReport | None = None) -> Mapper:
    """The worker for the runner; ``start`` says on the bus what takes long until it is there."""
    start = start or StartReport(SERVICE, bus.clock)
    config = config.model_copy(update={"device": resolved_device(config.device, bus.clock)})
    torch.set_num_threads(TORCH_THREADS)
    buses = buses_of(bus, config.robots)
    for further in buses[1:]:
        start.add(further)
    prepare(config, start)
    return Mapper(buses, config)
