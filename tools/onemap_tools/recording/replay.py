"""``onemap replay FILE.mcap``: the map of a recording, without a robot and without a bus."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import torch

from onemap_mapper.belief.map import BeliefMap, FieldRejected
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.service import TORCH_THREADS
from onemap_mapper.storage import map_file
from onemap_mapper.storage.snapshot import sha256_of, take, versions
from onemap_perception.config import PerceptionConfig
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_shared.config import read, section
from onemap_shared.grid import GridTooLarge
from onemap_shared.messages import (
    FeatureField,
    MapDigest,
    MapRevision,
    RgbdFrame,
)
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra
from onemap_tools.recording.bag_file import (
    CUT_OFF,
    DIGESTS,
    FIELDS,
    FRAMES,
    REVISIONS,
    BagError,
    BagMessage,
    BagReader,
    is_ros2,
)

if TYPE_CHECKING:
    from onemap_tools.recording.ros2_frames import Ros2Bag


class Change(Enum):
    """What changed the map."""

    NEW_MAP = "an empty map"
    FUSE = "a frame was fused"
    RESET = "a search began"
    GAP = "something that the recording does not hold"


MapStep: TypeAlias = tuple[Change, MapRevision]  # with the revision that was announced after it


def map_steps(revisions: Iterable[MapRevision]) -> Iterator[MapStep]:
    """The changes that lead from each revision to the next, beginning without a map.

    A revision counts every change, ``frames_fused`` the frames: if one was lost, or if a map was
    loaded, they do not fit, which is a gap.
    """
    before: MapRevision | None = None
    for after in revisions:
        yield from ((change, after) for change in _changes(before, after))
        before = after


def _changes(before: MapRevision | None, after: MapRevision) -> tuple[Change, ...]:
    steps = after.revision - before.revision if before is not None else None
    frames = after.frames_fused - before.frames_fused if before is not None else 0
    if steps == frames == 0:
        return ()  # the found objects changed
    if after.frames_fused == 0:
        return (Change.NEW_MAP,)
    if (after.frames_fused, after.revision) == (1, 1):
        return (Change.NEW_MAP, Change.FUSE)
    if steps == 1 and frames in (0, 1):
        return (Change.FUSE if frames else Change.RESET,)
    return (Change.GAP, Change.FUSE) if frames > 0 else (Change.GAP,)


@dataclass(slots=True)
class MapHistory:
    """What a recording says of the map: its changes, its digests, the frames that it holds."""

    revisions: list[MapRevision] = field(default_factory=list)
    digests: list[MapDigest] = field(default_factory=list)
    stamps_ns: set[int] = field(default_factory=set)  # of the recorded fields
    cut_off: bool = False

    @property
    def steps(self) -> Iterator[MapStep]:
        """The changes of the map; frames that are not in the recording are gaps."""
        for change, after in map_steps(self.revisions):
            lost = change is Change.FUSE and after.stamp_ns not in self.stamps_ns
            yield (Change.GAP if lost else change, after)


def read_history(path: Path) -> MapHistory:
    """Read the small topics of a recording; raises BagError."""
    reader, history = BagReader(path), MapHistory()
    for message in reader.messages():
        if message.topic == REVISIONS.key:
            history.revisions.append(message.decode(MapRevision))
        elif message.topic == DIGESTS.key:
            history.digests.append(message.decode(MapDigest))
        elif message.topic == FIELDS.key:
            history.stamps_ns.add(message.stamp_ns)
    history.cut_off = reader.cut_off
    return history


@dataclass(slots=True)
class MapRebuild:
    """A map that is computed again, compared with the recorded digests on the way.

    digests: by revision, frames and stamp. compared, equal: digests that were compared, and those
    that were the same. gaps: changes since the map was empty that the recording does not hold;
    nothing is compared after one.
    """

    belief: BeliefMap
    digests: dict[tuple[int, int, int], MapDigest] = field(default_factory=dict)
    known: bool = False
    gaps: int = 0
    rejected: int = 0
    compared: int = 0
    equal: int = 0
    first_difference: int | None = None

    def follow(self, steps: Iterable[MapStep], fields: Iterator[FeatureField]) -> None:
        """Apply the changes; the fields come in the order in which the mapper took them."""
        for change, after in steps:
            match change:
                case Change.NEW_MAP:
                    first = after.revision if after.frames_fused == 0 else 0
                    self.belief = BeliefMap(self.belief.params, first_revision=first)
                    self.known, self.gaps = True, 0
                case Change.RESET:
                    self.belief.reset_searched()
                case Change.GAP:
                    self.gaps += 1
                    self.known = False
                case Change.FUSE:
                    self.fuse(next(each for each in fields if each.stamp_ns == after.stamp_ns))
            if self.known and self.belief.frames_fused == after.frames_fused:
                self._compare(after)

    def fuse(self, frame: FeatureField) -> None:
        """Fuse one frame, unless it does not fit the map, as after a gap."""
        try:
            self.belief.check_pose(frame.T_map_camera)
            self.belief.fuse(compute_update(frame, self.belief.params))
        except (FieldRejected, GridTooLarge):
            self.rejected += 1

    def _compare(self, after: MapRevision) -> None:
        digest = self.digests.get((after.revision, after.frames_fused, after.stamp_ns))
        if digest is None:
            return
        self.compared += 1
        if sha256_of(take(self.belief)) == digest.sha256:
            self.equal += 1
        elif self.first_difference is None:
            self.first_difference = after.revision


def recorded_frames(path: Path) -> Iterator[RgbdFrame]:
    """All recorded images with their poses; raises BagError."""
    return (message.decode(RgbdFrame) for message in _on(path, FRAMES.key))


def _on(path: Path, topic: str) -> Iterator[BagMessage]:
    return (message for message in BagReader(path).messages() if message.topic == topic)


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """The recording, and what is done with it. ``out``: where the map is written."""

    path: Path
    config: Path | None = None
    reencode: bool = False
    out: Path | None = None


def replay(options: ReplayOptions) -> dict[str, Any]:
    """Compute the map again; one JSON object. CliError for what cannot be read or written."""
    bag: Ros2Bag | None = None
    if is_ros2(options.path):
        options = replace(options, reencode=True)
        with requires_extra("ros2", "A bag of ROS 2"):
            from onemap_ros2.config import Ros2Config
            from onemap_tools.recording.ros2_frames import Ros2Bag
        bag = Ros2Bag(options.path, section(read(options.config), "ros2", Ros2Config))
    history = read_history(options.path) if bag is None else MapHistory()
    params = _map_params(options, history)
    torch.set_num_threads(TORCH_THREADS)
    if options.reencode:
        frames = recorded_frames(options.path) if bag is None else bag.frames()
        made = _encoded_again(frames, options.config, params)
    else:
        made = _rebuilt(options.path, history, params)
    if not made.belief.store.count:
        what = "images" if options.reencode else "features and map revisions"
        raise CliError(f"{options.path} holds no {what} of which a map could be made.")
    if options.out is not None:
        try:
            map_file.write(take(made.belief), options.out)
        except OSError as problem:
            raise CliError(f"Cannot write {options.out}: {problem.strerror}.") from problem
    problems = _problems(history, made, reencoded=options.reencode)
    return {
        "file": str(options.path),
        "cut_off": history.cut_off,
        "reencoded": options.reencode,
        "encoder_id": made.belief.encoder_id,
        "frames_fused": made.belief.frames_fused,
        "cells": made.belief.store.count,
        "sha256": sha256_of(take(made.belief)),
        "compared": made.compared,
        "equal": made.equal,
        "first_difference": made.first_difference,
        "same": None if not made.compared else made.compared == made.equal,
        "problems": [*problems, *(bag.problems if bag is not None else ())],
        "out": None if options.out is None else str(options.out),
    }


def _map_params(options: ReplayOptions, history: MapHistory) -> MapParams:
    """The settings of the mapper that was recorded; those of --config if images are encoded."""
    if not history.digests or (options.reencode and options.config is not None):
        return section(read(options.config), "mapper", MapperConfig).map
    try:
        params = MapParams(**json.loads(history.digests[0].settings))
    except (TypeError, ValueError) as problem:
        raise BagError(
            f"{options.path} was recorded with settings of the mapper that this version does not "
            f"know: {problem}."
        ) from problem
    if params.device.startswith("cuda") and not torch.cuda.is_available():
        return replace(params, device="cpu")
    return params


def _rebuilt(path: Path, history: MapHistory, params: MapParams) -> MapRebuild:
    """The map of the recorded features; raises BagError."""
    made = MapRebuild(BeliefMap(params))
    made.digests = {(d.revision, d.frames_fused, d.stamp_ns): d for d in history.digests}
    fields = (message.decode(FeatureField) for message in _on(path, FIELDS.key))
    made.follow(history.steps, fields)
    return made


def _encoded_again(
    frames: Iterable[RgbdFrame], config: Path | None, params: MapParams
) -> MapRebuild:
    """The map of these frames with the encoder of --config."""
    perception = section(read(config), "perception", PerceptionConfig)
    observation = VarianceParams(perception.variance)
    made = MapRebuild(BeliefMap(params))
    try:
        encoder = make_encoder(perception.encoder)
        for frame in frames:
            made.fuse(feature_field(frame, encoder.encode(frame.rgb), encoder, observation))
    except BackendError as problem:
        raise CliError(f"{problem}.", EXIT_USAGE_ERROR) from problem
    return made


def _problems(history: MapHistory, made: MapRebuild, *, reencoded: bool) -> Iterator[str]:
    """Why the map is not, or not surely, the recorded one; each in one sentence."""
    if made.gaps:
        yield (
            f"{made.gaps} changes of the map are not in the recording: it began with a map that "
            "was not empty (see --clear-map), a map was loaded, or messages were missed."
        )
    recorded = sorted({digest.versions for digest in history.digests} - {versions()})
    if made.compared > made.equal and recorded:
        yield (
            f"Recorded with {'; '.join(recorded)}, computed with {versions()}: last bits may "
            "differ."
        )
    if made.rejected:
        yield f"{made.rejected} frames do not fit the map."
    if not reencoded and not made.compared:
        yield "No digest of the map could be compared."


def describe(document: dict[str, Any]) -> list[str]:
    """The result for people, line by line."""
    lines = [
        f"A map of {document['cells']} cells from {document['frames_fused']} frames with encoder "
        f"{document['encoder_id']}, SHA-256 {document['sha256'][:16]}..."
    ]
    if document["same"]:
        lines.append(
            f"Bit for bit the recorded one: all {document['compared']} digests are the same."
        )
    elif document["compared"]:
        lines.append(
            f"It is not the recorded one: {document['compared'] - document['equal']} of "
            f"{document['compared']} digests differ, first at revision "
            f"{document['first_difference']}."
        )
    if document["cut_off"]:
        lines.append(f"{CUT_OFF} The map is of what precedes that.")
    return [*lines, *document["problems"]]
