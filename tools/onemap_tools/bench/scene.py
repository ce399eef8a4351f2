"""What an encoder sees in a scene file or in a recording: a map of it, asked for labelled places.

With the services' pure modules, without a bus and without a robot that moves.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
import torch
import yaml
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from onemap_gateway.present.render import Overlay, encode_png, render_map
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.query.replies import search_view
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery, text_query
from onemap_perception.config import SHIPPED, PerceptionConfig
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError, UnknownWordError
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams
from onemap_perception.text.vocabulary import Vocabulary, load_vocabulary
from onemap_shared.config import read, section
from onemap_shared.geometry import F32, F64, Bool, pose_2d
from onemap_shared.messages import RgbdFrame, SimilarityReply
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_simulator.replay.layouts import is_recording, read_recording
from onemap_simulator.replay.recording import RecordingError
from onemap_simulator.scene.loading import load_scene
from onemap_simulator.scene.scene import STRUCTURE, UNNAMED, Scene
from onemap_tools.bench.frames import FRAME_NS, answer, map_of, rendered_frames
from onemap_tools.bench.options import SceneBench
from onemap_tools.errors import requires_extra
from onemap_tools.models.calibration import EXCLUDED_CLASSES
from onemap_tools.recording.bag_file import BagError

BAG_SUFFIXES = (".mcap", ".db3")
MAX_ANSWERS = 20  # regions of one reply: more than one room holds of a thing
CLEARANCE_M = 0.4  # from walls and furniture: closer, an image shows a patch of one thing
MIN_CLEARANCE_M = 0.25  # in narrow scenes; a little more than a robot's radius
HEADINGS = 8  # at each place: 45 degrees apart, of a view of 79
COLUMNS = ("name", "x", "y", "radius", "here", "elsewhere", "rank", "found", "looks most like")
MARGIN_M = 0.3  # around an object of a scene: an answer's centre may lie on its edge
# The map's reply for each word, with the score of every cell; None: the encoder cannot place it.
Replies: TypeAlias = Mapping[str, SimilarityReply | None]
# Metres up to 100 km: what is larger is in another unit.
Coordinate = Annotated[float, Field(ge=-1e5, le=1e5, allow_inf_nan=False)]


class PlaceLabel(BaseModel):
    """Something called ``name`` stands within ``radius_m`` of (x, y), metres in the map frame."""

    model_config = ConfigDict(frozen=True, extra="forbid", str_strip_whitespace=True)
    name: Annotated[str, Field(min_length=1)]
    x: Coordinate
    y: Coordinate
    radius_m: Annotated[float, Field(gt=0, le=1e5)]

    def holds(self, places_m: F64 | F32) -> Bool:
        """Which of the places (..., 2) lie in it."""
        apart = np.linalg.norm(places_m - np.array([self.x, self.y]), axis=-1)
        return np.asarray(apart <= self.radius_m)


def run(options: SceneBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """Map, ask and compare; ValueError in one sentence for what is wrong with the input."""
    torch.set_num_threads(options.threads)
    sections = read(options.config)
    perception = section(sections, "perception", PerceptionConfig)
    params = section(sections, "mapper", MapperConfig).map
    if options.out is not None:
        try:
            options.out.mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            reason = problem.strerror or problem
            raise ValueError(f"cannot write to {options.out}: {reason}") from problem
    try:
        encoder = make_encoder(perception.encoder)
        started_s = time.perf_counter()
        labels, frames = _open(options, sections.get("ros2", {}), tell)
        names = tuple(dict.fromkeys(label.name for label in labels))
        if names:
            check_names(names, encoder, options.labels or options.path)
        belief = map_of(frames, encoder, VarianceParams(perception.variance), params)
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
    bounds_m = render_map(search_view(MapScores(belief).of([]), text="")).bounds_m
    document = {
        "benchmark": "scene",
        "path": str(options.path),
        "labels": str(options.labels) if options.labels else None,
        "encoder_id": encoder.encoder_id,
        "frames": belief.frames_fused,
        "cells": belief.store.count,
        "seconds": round(time.perf_counter() - started_s, 2),
        "bounds_m": [round(bound, 3) for bound in bounds_m],
        **totals(labels, results, replies),
        "places": results,
    }
    if options.out is not None:
        write(options.out, document, belief, labels, encoder)
    return document


def _open(
    options: SceneBench, ros2: Mapping[str, Any], tell: Callable[[str], None]
) -> tuple[tuple[PlaceLabel, ...], Iterator[RgbdFrame]]:
    """The labels and the frames of a recording or of a tour through a scene file."""
    path = options.path
    labels = read_labels(options.labels) if options.labels else None
    if path.is_dir() or path.suffix in BAG_SUFFIXES:
        if labels is None:
            raise ValueError(
                f"{path} is a recording, which names nothing: give --labels, a file with [] for "
                "the map alone"
            )
        frames = recorded_frames(path, tell) if is_recording(path) else bag_frames(path, ros2)
        return labels, islice(frames, 0, None, options.every)
    scene, camera = load_scene(path), CameraParams()
    if labels is None and not (labels := labels_of_scene(scene)):
        raise ValueError(
            f"{path} has no named objects: give --labels, or names in the YAML beside it"
        )
    poses = tour_poses(scene, camera, options.places)
    return labels, (frame for frame, _ in rendered_frames(scene, camera, poses))


def recorded_frames(path: Path, tell: Callable[[str], None]) -> Iterator[RgbdFrame]:
    """All frames of a recording's folder, in their order; raises RecordingError.

    tell: is given the sentence about frames that are left out.
    """
    recording = read_recording(path)
    if recording.skipped:
        tell(f"{recording.skipped_sentence}.")
    for index in range(len(recording)):
        frame, stamp_ns = recording.frame(index), (index + 1) * FRAME_NS
        intrinsics, pose = recording.intrinsics, frame.T_map_camera
        yield RgbdFrame(index, stamp_ns, frame.rgb, frame.depth_mm, intrinsics, pose)


def bag_frames(path: Path, ros2: Mapping[str, Any]) -> Iterator[RgbdFrame]:
    """All images of a file of 'onemap record' or of a bag of ROS 2; raises BagError.

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


def read_labels(path: Path) -> tuple[PlaceLabel, ...]:
    """The labels of a YAML file: a list, maybe empty; ValueError names the wrong entry."""
    try:
        entries = yaml.safe_load(path.read_text(encoding="utf-8"))
        return tuple(TypeAdapter(list[PlaceLabel]).validate_python(entries))
    except OSError as problem:
        raise ValueError(f"cannot read {path}: {problem.strerror or problem}") from problem
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        raise ValueError(f"{path} is not valid YAML: {' '.join(str(problem).split())}") from problem
    except ValidationError as problem:
        first = problem.errors()[0]
        number, *key = first["loc"] or ("",)
        where = f", entry {int(number) + 1}" if number != "" else ""
        raise ValueError(
            f"{path}{where}: {' '.join(map(str, (*key, first['msg'])))}; it must be a list of "
            "places with name, x, y, radius_m in metres, or [] for none"
        ) from problem


def labels_of_scene(scene: Scene) -> tuple[PlaceLabel, ...]:
    """A label for each object with a name that is no part of the building.

    Around the middle of the rectangle that the object covers seen from above, MARGIN_M wider
    than the circle around it.
    """
    labels = []
    for index, thing in enumerate(scene.objects):
        faces = scene.faces[scene.face_object == index]
        if thing.category in STRUCTURE | {UNNAMED} or not len(faces):
            continue
        corners = scene.vertices[faces].reshape(-1, 3)[:, :2].astype(np.float64)
        lower, upper = corners.min(axis=0), corners.max(axis=0)
        x, y = ((lower + upper) / 2).tolist()
        radius_m = float(np.linalg.norm(upper - lower)) / 2 + MARGIN_M
        labels.append(PlaceLabel(name=thing.category, x=x, y=y, radius_m=radius_m))
    return tuple(labels)


def check_names(names: tuple[str, ...], encoder: Encoder, file: Path) -> None:
    """ValueError with the encoder's reason if it can embed none of the names."""
    try:
        encoder.embed_text(names)
    except UnknownWordError as error:
        if set(names) <= set(error.words):
            why = f"{file}: the encoder knows none of the labels' names: {error}"
            raise ValueError(why) from error


def tour_poses(scene: Scene, camera: CameraParams, places: int) -> list[F64]:
    """Poses T_map_camera (4, 4): ``places`` places with HEADINGS each, without chance.

    The first place is the reachable floor nearest to the scene's start; each further one is the
    floor that is farthest from all before it, fewer on a floor with fewer cells. ValueError
    without floor that can be reached.
    """
    collision = CollisionMap.of(scene, camera.height_m)
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
    while len(chosen) < min(places, len(floor)):
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(floor - floor[chosen[-1]], axis=1))
    return [
        pose_2d(x, y, 2 * np.pi * heading / HEADINGS) @ camera.mount
        for x, y in floor[chosen].tolist()
        for heading in range(HEADINGS)
    ]


def ask(belief: BeliefMap, encoder: Encoder, word: str) -> SimilarityReply | None:
    """The map's answers to a word with the score of every cell; None if it is unknown."""
    try:
        embeddings = encoder.embed_text((word,))
    except UnknownWordError:
        return None
    query = text_query(embeddings, 0, belief.params.torch_device)
    return answer(belief, query, max_regions=MAX_ANSWERS, grid=True)


def place_results(
    labels: Sequence[PlaceLabel], replies: Replies, vocabulary: Vocabulary
) -> list[dict[str, Any]]:
    """A JSON object per label. ``replies`` holds those of all labels' names, and of other words.

    best_here, best_elsewhere: highest score of a cell in the place, and outside of all places of
    this name; None without such a cell. rank: of the first answer whose centre lies in the place;
    None if none does: then it is not found. looks_like: the other word with the highest score in
    the place. known: whether the encoder can place the word; without that it is not asked for.
    """
    if not labels:
        return []
    answered = {word: reply for word, reply in replies.items() if reply is not None}
    first = next(iter(answered.values()))
    centres_m = first.grid.centres(np.moveaxis(np.indices(first.grid.shape), 0, -1))
    results = []
    for label in labels:
        reply, here = answered.get(label.name), label.holds(centres_m)
        named = [each.holds(centres_m) for each in labels if each.name == label.name]
        others = [
            (score, word)
            for word, other in answered.items()
            if not same_thing(word, label.name, vocabulary)
            and (score := _best(other.scores_grid, here)) is not None
        ]
        score, like = max(others, default=(None, None))
        ranks = np.flatnonzero(label.holds(reply.centres_m)).tolist() if reply else []
        elsewhere = ~np.logical_or.reduce(named)
        results.append(
            {
                **label.model_dump(),
                "known": reply is not None,
                "mapped": _best(first.scores_grid, here) is not None,
                "best_here": _best(reply.scores_grid, here) if reply else None,
                "best_elsewhere": _best(reply.scores_grid, elsewhere) if reply else None,
                "rank": ranks[0] + 1 if ranks else None,
                "looks_like": like,
                "looks_like_score": score,
                "found": bool(ranks),
            }
        )
    return results


def _best(scores: F32, cells: Bool) -> float | None:
    """Highest score (nx, ny) of the observed ones of the cells; None if none was observed."""
    chosen = scores[cells & np.isfinite(scores)]
    return round(float(chosen.max()), 4) if chosen.size else None


def same_thing(a: str, b: str, vocabulary: Vocabulary) -> bool:
    """Whether two words are equal or names of one class."""

    def class_of(word: str) -> int | None:
        trained = vocabulary.class_of(word)
        return vocabulary.query_alias_of(word) if trained is None else trained

    return a == b or (class_of(a) is not None and class_of(a) == class_of(b))


def totals(
    labels: Sequence[PlaceLabel], results: Sequence[Mapping[str, Any]], replies: Replies
) -> dict[str, Any]:
    """Counts of places, and of names by their first answer."""
    verdicts: dict[str, bool | None] = {}
    for label in labels:
        reply = replies[label.name]
        if reply is None or not len(reply.centres_m):
            verdicts[label.name] = None
        else:
            right = bool(label.holds(reply.centres_m[0]))
            verdicts[label.name] = verdicts.get(label.name) or right
    counts = list(verdicts.values())
    return {
        "labelled": len(labels),
        "found": sum(result["found"] for result in results),
        "not_mapped": sum(not result["mapped"] for result in results),
        "names": len(counts),
        "first_answer_right": counts.count(True),
        "first_answer_wrong": counts.count(False),
        "without_answer": counts.count(None),
        "unknown_words": sorted({result["name"] for result in results if not result["known"]}),
    }


def _within(x: float, y: float, bounds_m: Sequence[float]) -> bool:
    """Whether (x, y), metres, lies in the bounds (x_min, y_min, x_max, y_max)."""
    x_min, y_min, x_max, y_max = bounds_m
    return x_min <= x <= x_max and y_min <= y <= y_max


def lines(document: Mapping[str, Any]) -> list[str]:
    """The document of a run as lines of text."""
    run = (
        f"{document['encoder_id']}, {document['frames']} frames, {document['cells']} cells, "
        f"{document['seconds']:.1f} s"
    )
    places = document["places"]
    if not places:
        return ["No place is labelled: the map was asked for nothing.", run]
    rows = [COLUMNS, *map(_row, places)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    told = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    told += [
        "",
        f"{document['found']} of {document['labelled']} places found; of {document['names']} names "
        f"the first answer is right for {document['first_answer_right']}, wrong for "
        f"{document['first_answer_wrong']}, and {document['without_answer']} have none.",
    ]
    if unknown := document["unknown_words"]:
        told.append(f"Not asked for, unknown to the encoder: {', '.join(unknown)}.")
    if outside := [
        f"{place['name']} at ({place['x']:g}, {place['y']:g})"
        for place in places
        if not place["mapped"] and not _within(place["x"], place["y"], document["bounds_m"])
    ]:
        x_min, y_min, x_max, y_max = document["bounds_m"]
        told.append(
            f"Not mapped because outside the map, which reaches from ({x_min:.1f}, {y_min:.1f}) "
            f"to ({x_max:.1f}, {y_max:.1f}) m: {', '.join(outside)}."
        )
    return [*told, run]


def _row(place: Mapping[str, Any]) -> tuple[str, ...]:
    verdict = "yes" if place["found"] else "no"
    if not place["known"]:
        verdict = "unknown word"
    elif not place["mapped"]:
        verdict = "not mapped"

    def shown(key: str) -> str:
        return "-" if place[key] is None else f"{place[key]:.2f}"

    return (
        place["name"],
        *(shown(key) for key in ("x", "y", "radius_m", "best_here", "best_elsewhere")),
        str(place["rank"] or "-"),
        verdict,
        f"{place['looks_like']} {shown('looks_like_score')}" if place["looks_like"] else "-",
    )


def write(
    folder: Path,
    document: dict[str, Any],
    belief: BeliefMap,
    labels: Sequence[PlaceLabel],
    encoder: Encoder,
) -> None:
    """Write the document, the map with all labels, and the map of each name with its labels."""
    shown = [label for label in labels if _within(label.x, label.y, document["bounds_m"])]
    names = dict.fromkeys(label.name for label in labels)
    text = json.dumps(document, indent=2) + "\n"
    (folder / "scene.json").write_text(text, encoding="utf-8")
    (folder / "scene.png").write_bytes(_picture(belief, [], "", shown))
    for name in (each for each in names if each not in document["unknown_words"]):
        query = text_query(encoder.embed_text((name,)), 0, belief.params.torch_device)
        there = [label for label in shown if label.name == name]
        png = _picture(belief, [query], name, there)
        (folder / f"{name.replace('/', '-')}.png").write_bytes(png)


def _picture(
    belief: BeliefMap, queries: Sequence[TextQuery], name: str, labels: Sequence[PlaceLabel]
) -> bytes:
    """PNG of the map with the labels, and with the similarity to the query if there is one."""
    view = search_view(MapScores(belief).of(queries), text=name)
    places = tuple((label.name, label.x, label.y) for label in labels)
    return encode_png(render_map(view, Overlay(found=places)).image)
