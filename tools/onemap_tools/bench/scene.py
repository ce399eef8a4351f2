"""What an encoder sees in a scene file or in a recording: a map of it, asked for labelled places.

With the services' pure modules, without a bus and without a robot that moves.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import text_query
from onemap_perception.config import PerceptionConfig
from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError, UnknownWordError
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.config import section
from onemap_shared.messages import RgbdFrame, SimilarityReply, SimilarityRequest
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm
from onemap_simulator.replay.recording import Recording, RecordingError
from onemap_simulator.scene.loading import load_scene
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.place_labels import PlaceLabel, labels_of_scene, read_labels
from onemap_tools.bench.place_report import place_document, place_results, totals
from onemap_tools.bench.queries import EXCLUDED_CLASSES
from onemap_tools.bench.scene_folder import create, picture_bounds_m, write
from onemap_tools.bench.scene_tour import tour_poses
from onemap_tools.errors import requires_extra
from onemap_tools.recording.bag_file import BagError

BAG_SUFFIX = ".mcap"
FRAME_NS = 100_000_000
MAX_ANSWERS = 20  # regions of one reply: more than one room holds of a thing


@dataclass(frozen=True, slots=True)
class SceneBenchParams:
    """What to map and how. ``labels``: None takes a scene file's own names.

    every: of a recording, every Nth frame is mapped. ros2: the section of that name, for
    bags of ROS 2. out: folder of the results, which is created before anything is mapped.
    """

    path: Path
    labels: Path | None = None
    places: int = 8
    every: int = 1
    out: Path | None = None
    ros2: Mapping[str, Any] = field(default_factory=dict)
    perception: PerceptionConfig = field(default_factory=PerceptionConfig)
    mapper: MapperConfig = field(default_factory=MapperConfig)


def run(params: SceneBenchParams) -> dict[str, Any]:
    """Map, ask and compare; ValueError in one sentence for what is wrong with the input."""
    if params.out is not None:
        create(params.out)
    try:
        encoder = make_encoder(params.perception.encoder)
        started_s = time.perf_counter()
        labels, frames = _open(params)
        names = tuple(dict.fromkeys(label.name for label in labels))
        if names:
            check_names(names, encoder, params.labels or params.path)
        belief = map_frames(frames, encoder, params)
    except (BackendError, RecordingError, BagError) as error:
        raise ValueError(str(error)) from error
    if not belief.store.count:
        why = "its frames have no depth" if belief.frames_fused else "it holds no images"
        raise ValueError(f"nothing of {params.path} could be mapped: {why}")
    vocabulary = load_vocabulary(SHIPPED)
    others = (word for word in vocabulary.names if word not in {*names, *EXCLUDED_CLASSES})
    words = (*names, *others) if names else ()
    replies = {word: ask(belief, encoder, word) for word in words}
    results = place_results(labels, replies, vocabulary)
    document = {
        "benchmark": "scene",
        "path": str(params.path),
        "labels": str(params.labels) if params.labels else None,
        "encoder_id": encoder.encoder_id,
        "frames": belief.frames_fused,
        "cells": belief.store.count,
        "seconds": round(time.perf_counter() - started_s, 2),
        "bounds_m": picture_bounds_m(belief),
        **totals(labels, results, replies),
        "places": [place_document(result) for result in results],
    }
    if params.out is not None:
        write(params.out, document, belief, labels, encoder)
    return document


def _open(params: SceneBenchParams) -> tuple[tuple[PlaceLabel, ...], Iterator[RgbdFrame]]:
    """The labels and the frames of a recording or of a tour through a scene file."""
    labels = read_labels(params.labels) if params.labels else None
    if params.path.is_dir() or params.path.suffix == BAG_SUFFIX:
        if labels is None:
            raise ValueError(
                f"{params.path} is a recording, which names nothing: give --labels, a file with "
                "[] for the map alone"
            )
        frames = (
            recorded_frames(Recording.open(params.path))
            if params.path.is_dir()
            else bag_frames(params.path, params.ros2)
        )
        return labels, islice(frames, 0, None, params.every)
    scene = load_scene(params.path)
    if labels is None and not (labels := labels_of_scene(scene)):
        raise ValueError(
            f"{params.path} has no named objects: give --labels, or names in the YAML beside it"
        )
    return labels, toured_frames(scene, params.places)


def recorded_frames(recording: Recording) -> Iterator[RgbdFrame]:
    """All frames of a recording, in their order."""
    for index in range(len(recording)):
        frame = recording.frame(index)
        yield RgbdFrame(
            index,
            (index + 1) * FRAME_NS,
            frame.rgb,
            frame.depth_mm,
            recording.intrinsics,
            frame.T_map_camera,
        )


def bag_frames(path: Path, ros2: Mapping[str, Any]) -> Iterator[RgbdFrame]:
    """All images of an MCAP file, of 'onemap record' or of ROS 2; raises BagError.

    ros2: the section of that name, which says the topics.
    """
    with requires_extra("record", "A recording in MCAP"):
        from onemap_tools.recording import replay
        from onemap_tools.recording.bag_file import is_ros2
    if not is_ros2(path):
        return replay.recorded_frames(path)
    with requires_extra("ros2", "A bag of ROS 2"):
        from onemap_ros2.config import Ros2Config
        from onemap_tools.recording.ros2_frames import Ros2Bag
    return Ros2Bag(path, section({"ros2": ros2}, "ros2", Ros2Config)).frames()


def toured_frames(scene: Scene, places: int) -> Iterator[RgbdFrame]:
    """What the simulator's camera shows from places spread over the floor, turning all around."""
    camera, renderer = CameraParams(), Renderer(scene)
    for index, pose in enumerate(tour_poses(scene, camera, places)):
        view = renderer.render(pose, camera.intrinsics, width=camera.width, height=camera.height)
        depth_mm = measured_mm(view.depth_m, camera.min_depth_m, camera.max_depth_m)
        stamp_ns = (index + 1) * FRAME_NS
        yield RgbdFrame(index, stamp_ns, view.rgb, depth_mm, camera.intrinsics, pose)


def map_frames(
    frames: Iterator[RgbdFrame], encoder: Encoder, params: SceneBenchParams
) -> BeliefMap:
    """The map of all frames."""
    belief = BeliefMap(params.mapper.map)
    for frame in frames:
        features = encoder.encode(frame.rgb)
        fields = feature_field(frame, features, encoder, VarianceParams(params.perception.variance))
        belief.fuse(compute_update(fields, belief.params))
    return belief


def ask(belief: BeliefMap, encoder: Encoder, word: str) -> SimilarityReply | None:
    """The map's answers to a word with the score of every cell; None if it is unknown."""
    try:
        embeddings = encoder.embed_text((word,))
    except UnknownWordError:
        return None
    query = text_query(embeddings, 0, belief.params.torch_device)
    return similarity_reply(
        MapScores(belief).of([query]),
        request=SimilarityRequest(word, max_regions=MAX_ANSWERS, include_grid=True),
    )


def check_names(names: tuple[str, ...], encoder: Encoder, file: Path) -> None:
    """ValueError with the encoder's reason if it can embed none of the names."""
    try:
        encoder.embed_text(names)
    except UnknownWordError as error:
        if set(names) <= set(error.words):
            raise ValueError(
                f"{file}: the encoder knows none of the labels' names: {error}"
            ) from error
