"""Pictures of things as queries: how often the best region is where such a thing stands.

Each generated apartment is mapped from images of sampled poses; its things are cut out of other
images of it, along their true boxes. A crop of a category that was shown to the map well enough
is asked there, and one of a category that an apartment has not is asked in that one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from onemap_mapper.config import MapperConfig
from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import text_query
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.encoders.protocol import ImageEncoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_shared.geometry import U8
from onemap_shared.messages import SimilarityRequest
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.rendering.camera_poses import sample_camera_poses
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.mapping import CAMERA, INTRINSICS, MappedScene, map_scene
from onemap_tools.bench.queries import EXCLUDED_CLASSES, NEAR_M, distance_m

OTHER_POSES = 1_000_000  # added to the seed of the map's: no crop is of an image in the map
CROP_IMAGES = 20
MIN_SIDE_PX, MIN_FILLED = 32, 0.4  # of a crop: smaller or emptier ones show something else


@dataclass(frozen=True, slots=True)
class Crop:
    """A thing as an image (H, W, 3) uint8 shows it."""

    category: str
    rgb: U8


@dataclass(frozen=True, slots=True)
class ImageOutcome:
    """One crop, asked of one map. near: the best region lies near such a thing; by_chance: a random
    observed cell does."""

    seed: int
    category: str
    present: bool
    score: float
    near: bool
    by_chance: bool


def run(
    config: EncoderParams, seeds: Sequence[int], images: int, report: Callable[[int], None]
) -> dict[str, Any]:
    """The rates over apartments; ValueError if the encoder cannot be loaded or takes no images.

    ``report`` receives the number of apartments done.
    """
    try:
        encoder = make_encoder(config)
    except BackendError as problem:
        raise ValueError(str(problem)) from problem
    if not isinstance(encoder, ImageEncoder):
        raise ValueError(f"the encoder {encoder.encoder_id} takes no images")
    outcomes: list[ImageOutcome] = []
    others: list[Crop] = []
    for number, seed in enumerate(seeds, 1):
        scene = generate_apartment(seed, TRAINING)
        mapped, own = map_scene(scene, encoder, seed, images), list(crops_of(scene, seed))
        outcomes += asked(mapped, encoder, [*own, *others], seed)
        others += own
        report(number)
    return {"encoder_id": encoder.encoder_id, **summarise(outcomes, MapperConfig().found_score)}


def crops_of(scene: Scene, seed: int) -> Iterator[Crop]:
    """All things that images from other poses than the map's show well."""
    renderer, rng = Renderer(scene), np.random.default_rng(seed + OTHER_POSES)
    for pose in sample_camera_poses(scene, rng, CROP_IMAGES):
        view = renderer.render(pose, INTRINSICS, width=CAMERA.width, height=CAMERA.height)
        for index in np.unique(view.labels[view.labels >= 0]).tolist():
            category = scene.objects[index].category
            rgb = None if category in EXCLUDED_CLASSES else crop_of(view, index)
            if rgb is not None:
                yield Crop(category, rgb)


def crop_of(view: RenderedImage, index: int) -> U8 | None:
    """The box of an object in an image; None if it is small, or mostly shows something else."""
    mask = view.labels == index
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    box = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    if min(mask[box].shape) < MIN_SIDE_PX or mask[box].mean() < MIN_FILLED:
        return None
    rgb: U8 = view.rgb[box].copy()
    return rgb


def asked(
    mapped: MappedScene, encoder: ImageEncoder, crops: Sequence[Crop], seed: int
) -> Iterator[ImageOutcome]:
    """Ask a map for every crop whose category is clearly present or absent."""
    scores, config, rng = MapScores(mapped.belief), MapperConfig(), np.random.default_rng(seed)
    cells = mapped.belief.store.cells
    for number, crop in enumerate(crops):
        present = crop.category in mapped.observed
        if not present and crop.category in mapped.scene.categories:
            continue  # in the apartment, but not shown well enough
        query = text_query(encoder.embed_image(crop.rgb), 0, config.torch_device)
        scored = scores.of([replace(query, text=f"image {number}")])
        request = SimilarityRequest("image", max_regions=1)
        reply = similarity_reply(scored, request=request, params=config)
        somewhere = (cells[rng.integers(len(cells))] + 0.5) * config.cell_size_m
        near, by_chance = (
            present and distance_m(mapped.scene, crop.category, place) <= NEAR_M
            for place in (reply.centres_m[0], somewhere.astype(np.float32))
        )
        yield ImageOutcome(seed, crop.category, present, reply.best_score, near, by_chance)


def summarise(outcomes: Sequence[ImageOutcome], found_score: float) -> dict[str, Any]:
    """The rates. found_score: the mapper's, from which a verdict is found."""
    there = [one for one in outcomes if one.present]
    absent = [one for one in outcomes if not one.present]
    found = [one for one in there if one.score >= found_score]
    sofas = [one for one in there if one.category == "sofa"]
    return {
        "benchmark": "image queries",
        "apartments": len({one.seed for one in outcomes}),
        "present": len(there),
        "near": _rate([one.near for one in there]),
        "near_by_chance": _rate([one.by_chance for one in there]),
        "found": _rate([one.score >= found_score for one in there]),
        "found_near": _rate([one.near for one in found]),
        "sofas": len(sofas),
        "sofas_near": _rate([one.near for one in sofas]),
        "absent": len(absent),
        "absent_found": _rate([one.score >= found_score for one in absent]),
    }


def _rate(flags: Sequence[bool]) -> float | None:
    return round(float(np.mean(flags)), 3) if flags else None


def table_lines(result: dict[str, Any]) -> list[str]:
    """The report for people."""
    return [
        f"{result['present']} crops of things in {result['apartments']} apartments:",
        f"  best region near such a thing: {result['near']} (a random cell: "
        f"{result['near_by_chance']})",
        f"  verdict found: {result['found']}, of these near: {result['found_near']}",
        f"  {result['sofas']} sofas: {result['sofas_near']} near",
        f"{result['absent']} crops of things that the apartment has not:",
        f"  verdict found, which is wrong: {result['absent_found']}",
    ]
