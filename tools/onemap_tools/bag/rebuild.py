"""A map computed again from a recording: the same frames in the same order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from onemap_mapper.belief.map import BeliefMap, FieldRejected
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.storage.snapshot import sha256_of, take, versions
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_shared.grid import GridTooLarge
from onemap_shared.messages import (
    AnsweredQuery,
    FeatureField,
    MapDigest,
    MapRevision,
    RgbdFrame,
    TextEmbeddings,
)
from onemap_tools.bag.asked_again import AskedAgain
from onemap_tools.bag.bag_file import BagMessage, BagReader
from onemap_tools.bag.map_history import MapStep, StepKind, map_steps
from onemap_tools.bag.recorded_topics import (
    DIGESTS,
    EMBEDDINGS,
    FIELDS,
    FRAMES,
    POSE_GRAPHS,
    QUERIES,
    REVISIONS,
)

Place = tuple[int, int, int]  # of a digest in the map's history: revision, frames, stamp


@dataclass(slots=True)
class MapHistory:
    """What a recording says of the map: its changes, its digests, the frames that it holds."""

    revisions: list[MapRevision] = field(default_factory=list)
    digests: list[MapDigest] = field(default_factory=list)
    stamps_ns: set[int] = field(default_factory=set)  # of the recorded fields
    asked: AskedAgain = field(default_factory=AskedAgain)
    corrected: bool = False
    cut_off: bool = False

    @property
    def steps(self) -> Iterator[MapStep]:
        """The changes of the map; frames that are not in the recording are gaps."""
        for step in map_steps(self.revisions):
            lost = step.kind is StepKind.FUSE and step.after.stamp_ns not in self.stamps_ns
            yield MapStep(StepKind.GAP, step.after) if lost else step


def read_history(path: Path) -> MapHistory:
    """Read the small topics of a recording; raises BagError."""
    reader, history = BagReader(path), MapHistory()
    for message in reader.messages():
        if message.topic == REVISIONS.key:
            history.revisions.append(message.decode(MapRevision))
        elif message.topic == DIGESTS.key:
            history.digests.append(message.decode(MapDigest))
        elif message.topic == QUERIES.key:
            history.asked.add(message.decode(AnsweredQuery))
        elif message.topic == EMBEDDINGS.key:
            history.asked.embed(message.decode(TextEmbeddings))
        elif message.topic == FIELDS.key:
            history.stamps_ns.add(message.stamp_ns)
        elif message.topic == POSE_GRAPHS.key:
            history.corrected = True
    history.cut_off = reader.cut_off
    return history


@dataclass(slots=True)
class MapRebuild:
    """A map that is computed again, compared with the recorded digests on the way.

    compared, equal: digests that were compared, and those that were the same. gaps: changes
    since the map was empty that the recording does not hold; nothing is compared after one.
    """

    belief: BeliefMap
    digests: dict[Place, MapDigest]
    asked: AskedAgain = field(default_factory=AskedAgain)
    params: MapperConfig = field(default_factory=MapperConfig)
    known: bool = False
    gaps: int = 0
    rejected: int = 0
    compared: int = 0
    equal: int = 0
    first_difference: int | None = None

    def follow(self, steps: Iterable[MapStep], fields: Iterator[FeatureField]) -> None:
        """Apply the changes; the fields come in the order in which the mapper took them."""
        for step in steps:
            if step.kind is StepKind.NEW_MAP:
                empty = step.after.frames_fused == 0
                first = step.after.revision if empty else 0
                self.belief = BeliefMap(self.belief.params, first_revision=first)
                self.known, self.gaps = True, 0
            elif step.kind is StepKind.RESET:
                self.belief.reset_searched()
            elif step.kind is StepKind.GAP:
                self.gaps += 1
                self.known = False
            else:
                wanted = step.after.stamp_ns
                self.fuse(next(each for each in fields if each.stamp_ns == wanted))
            self._compare(step.after)

    def fuse(self, frame: FeatureField) -> None:
        """Fuse one frame, unless it does not fit the map, as after a gap."""
        try:
            self.belief.check_pose(frame.T_map_camera)
            self.belief.fuse(compute_update(frame, self.belief.params))
        except (FieldRejected, GridTooLarge):
            self.rejected += 1

    def _compare(self, after: MapRevision) -> None:
        if not self.known or self.belief.frames_fused != after.frames_fused:
            return
        self.asked.ask(self.belief, self.params)
        place = (after.revision, after.frames_fused, after.stamp_ns)
        digest = self.digests.get(place)
        if digest is None:
            return
        self.compared += 1
        if sha256_of(take(self.belief)) == digest.sha256:
            self.equal += 1
        elif self.first_difference is None:
            self.first_difference = after.revision


def rebuilt(path: Path, history: MapHistory, params: MapperConfig) -> MapRebuild:
    """The map of the recorded features; raises BagError."""
    digests = {(d.revision, d.frames_fused, d.stamp_ns): d for d in history.digests}
    asked = AskedAgain() if history.corrected else history.asked
    made = MapRebuild(BeliefMap(params), {} if history.corrected else digests, asked, params)
    fields = (message.decode(FeatureField) for message in _on(path, FIELDS.key))
    made.follow(history.steps, fields)
    return made


def recorded_frames(path: Path) -> Iterator[RgbdFrame]:
    """All recorded images with their poses; raises BagError."""
    return (message.decode(RgbdFrame) for message in _on(path, FRAMES.key))


def encoded_again(
    frames: Iterable[RgbdFrame], encoder: Encoder, observation: VarianceParams, params: MapperConfig
) -> MapRebuild:
    """The map of these frames with this encoder; raises BackendError."""
    made = MapRebuild(BeliefMap(params), {})
    for frame in frames:
        made.fuse(feature_field(frame, encoder.encode(frame.rgb), encoder, observation))
    return made


def problems_of(history: MapHistory, made: MapRebuild) -> list[str]:
    """Why the map is not, or not surely, the recorded one; each in one sentence."""
    problems = []
    if history.corrected:
        problems.append(
            "The map followed corrections of SLAM (robot/pose_graph); the frames are fused where "
            "they were first seen, so that nothing is compared."
        )
    if made.gaps:
        problems.append(
            f"{made.gaps} changes of the map are not in the recording: it began with a map that "
            "was not empty (see --clear-map), a map was loaded, or messages were missed."
        )
    recorded = sorted({digest.versions for digest in history.digests} - {versions()})
    if made.compared > made.equal and recorded:
        problems.append(
            f"Recorded with {'; '.join(recorded)}, computed with {versions()}: last bits may "
            "differ."
        )
    if made.rejected:
        problems.append(f"{made.rejected} frames do not fit the map.")
    return problems


def _on(path: Path, topic: str) -> Iterator[BagMessage]:
    return (message for message in BagReader(path).messages() if message.topic == topic)
