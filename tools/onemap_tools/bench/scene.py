"""What an encoder sees in a scene file or in a recording: a map of it, asked for labelled places.

With the services' pure modules, without a bus and without a robot that moves.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
import torch

from onemap_gateway.present.render import Overlay, encode_png, render_map
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.query.replies import search_view, similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery, text_query
from onemap_perception.config import PerceptionConfig
from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError, UnknownWordError
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.config import read, section
from onemap_shared.geometry import F64, pose_2d
from onemap_shared.messages import RgbdFrame, SimilarityReply, SimilarityRequest
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm
from onemap_simulator.replay.recording import Recording, RecordingError
from onemap_simulator.scene.loading import load_scene
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.options import SceneBench
from onemap_tools.bench.places import (
    PlaceLabel,
    labels_of_scene,
    place_results,
    read_labels,
    table_lines,
    totals,
    within,
)
from onemap_tools.bench.queries import EXCLUDED_CLASSES
from onemap_tools.errors import requires_extra
from onemap_tools.recording.bag_file import BagError

BAG_SUFFIX = ".mcap"
FRAME_NS = 100_000_000
MAX_ANSWERS = 20  # regions of one reply: more than one room holds of a thing
CLEARANCE_M = 0.4  # from walls and furniture: closer, an image shows a patch of one thing
MIN_CLEARANCE_M = 0.25  # in narrow scenes; a little more than a robot's radius
HEADINGS = 8  # at each place: 45 degrees apart, of a view of 79
lines = table_lines


def run(options: SceneBench, _tell: Callable[[str], None]) -> dict[str, Any]:
    """Map, ask and compare; ValueError in one sentence for what is wrong with the input."""
    torch.set_num_threads(options.threads)
    sections = read(options.config)
    perception = section(sections, "perception", PerceptionConfig)
    mapper = section(sections, "mapper", MapperConfig)
    if options.out is not None:
        create(options.out)
    try:
        encoder = make_encoder(perception.encoder)
        started_s = time.perf_counter()
        labels, frames = _open(options, sections.get("ros2", {}))
        names = tuple(dict.fromkeys(label.name for label in labels))
        if names:
            check_names(names, encoder, options.labels or options.path)
        belief = map_frames(frames, encoder, perception, mapper)
    except (BackendError, RecordingError, BagError) as error:
        raise ValueError(str(error)) from error
    if not belief.store.count:
        why = "its frames have no depth" if belief.frames_fused else "it holds no images"
        raise ValueError(f"nothing of {options.path} could be mapped: {why}")
    vocabulary = load_vocabulary(SHIPPED)
    others = (word for word in vocabulary.names if word not in {*names, *EXCLUDED_CLASSES})
    words = (*names, *others) if names else ()
    replies = {word: ask(belief, encoder, word) for word in words}
    results = place_results(labels, replies, vocabulary)
    document = {
        "benchmark": "scene",
        "path": str(options.path),
        "labels": str(options.labels) if options.labels else None,
        "encoder_id": encoder.encoder_id,
        "frames": belief.frames_fused,
        "cells": belief.store.count,
        "seconds": round(time.perf_counter() - started_s, 2),
        "bounds_m": picture_bounds_m(belief),
        **totals(labels, results, replies),
        "places": results,
    }
    if options.out is not None:
        write(options.out, document, belief, labels, encoder)
    return document


def _open(
    options: SceneBench, ros2: Mapping[str, Any]
) -> tuple[tuple[PlaceLabel, ...], Iterator[RgbdFrame]]:
    """The labels and the frames of a recording or of a tour through a scene file."""
    labels = read_labels(options.labels) if options.labels else None
    if options.path.is_dir() or options.path.suffix == BAG_SUFFIX:
        if labels is None:
            raise ValueError(
                f"{options.path} is a recording, which names nothing: give --labels, a file with "
                "[] for the map alone"
            )
        frames = (
            recorded_frames(Recording.open(options.path))
            if options.path.is_dir()
            else bag_frames(options.path, ros2)
        )
        return labels, islice(frames, 0, None, options.every)
    scene = load_scene(options.path)
    if labels is None and not (labels := labels_of_scene(scene)):
        raise ValueError(
            f"{options.path} has no named objects: give --labels, or names in the YAML beside it"
        )
    return labels, toured_frames(scene, options.places)


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
    frames: Iterator[RgbdFrame],
    encoder: Encoder,
    perception: PerceptionConfig,
    mapper: MapperConfig,
) -> BeliefMap:
    """The map of all frames."""
    belief = BeliefMap(mapper.map)
    for frame in frames:
        features = encoder.encode(frame.rgb)
        fields = feature_field(frame, features, encoder, VarianceParams(perception.variance))
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


def tour_poses(scene: Scene, camera: CameraParams, places: int) -> list[F64]:
    """Poses T_map_camera (4, 4): ``places`` places with HEADINGS each, without chance.

    The first place is the reachable floor nearest to the scene's start; each further one is the
    floor that is farthest from all before it. ValueError without floor that can be reached.
    """
    return [
        pose_2d(x, y, 2 * np.pi * heading / HEADINGS) @ camera.mount
        for x, y in tour_places(scene, camera.height_m, places).tolist()
        for heading in range(HEADINGS)
    ]


def tour_places(scene: Scene, height_m: float, count: int) -> F64:
    """Up to ``count`` places (n, 2) in metres; fewer on a floor with fewer cells."""
    collision = CollisionMap.of(scene, height_m)
    x, y = scene.start[:2]
    for clearance_m in (CLEARANCE_M, MIN_CLEARANCE_M):
        reachable = collision.reachable_cells(x, y, clearance_m)
        if reachable.any():
            break
    else:
        raise ValueError(f"scene {scene.name}: no free floor around its start ({x:.2f}, {y:.2f})")
    floor = collision.grid.centres(np.argwhere(reachable))
    chosen = [int(np.linalg.norm(floor - (x, y), axis=1).argmin())]
    apart = np.linalg.norm(floor - floor[chosen[0]], axis=1)
    while len(chosen) < min(count, len(floor)):
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(floor - floor[chosen[-1]], axis=1))
    return floor[chosen]


def picture_bounds_m(belief: BeliefMap) -> list[float]:
    """(x_min, y_min, x_max, y_max) of every picture of the map, in metres to the millimetre."""
    view = search_view(MapScores(belief).of([]), text="")
    return [round(bound, 3) for bound in render_map(view).bounds_m]


def create(folder: Path) -> None:
    """Create the folder and a file in it that goes at once; ValueError if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=folder):
            pass
    except OSError as problem:
        raise ValueError(
            f"cannot write to {folder}: {problem.strerror or problem}; choose another --out"
        ) from problem


def write(
    folder: Path,
    document: dict[str, Any],
    belief: BeliefMap,
    labels: Sequence[PlaceLabel],
    encoder: Encoder,
) -> None:
    """Write the document, the map with all labels, and the map of each name with its labels."""
    shown = [label for label in labels if within(label.x, label.y, document["bounds_m"])]
    try:
        text = json.dumps(document, indent=2) + "\n"
        (folder / "scene.json").write_text(text, encoding="utf-8")
        (folder / "scene.png").write_bytes(_picture(belief, [], "", shown))
        for name in dict.fromkeys(label.name for label in labels):
            if name in document["unknown_words"]:
                continue
            query = text_query(encoder.embed_text((name,)), 0, belief.params.torch_device)
            there = [label for label in shown if label.name == name]
            png = _picture(belief, [query], name, there)
            (folder / f"{name.replace('/', '-')}.png").write_bytes(png)
    except OSError as problem:
        raise ValueError(f"cannot write to {folder}: {problem.strerror or problem}") from problem


def _picture(
    belief: BeliefMap, queries: Sequence[TextQuery], name: str, labels: Sequence[PlaceLabel]
) -> bytes:
    """PNG of the map with the labels, and with the similarity to the query if there is one."""
    view = search_view(MapScores(belief).of(queries), text=name)
    places = tuple((label.name, label.x, label.y) for label in labels)
    return encode_png(render_map(view, Overlay(found=places)).image)
