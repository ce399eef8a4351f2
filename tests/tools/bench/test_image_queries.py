"""Crops of things lead to such things on a map, and not on one whose places are shuffled."""

from __future__ import annotations

import json

import numpy as np
import pytest

from onemap_perception.encoders.mini import MiniEncoder, MiniParams
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench import image_queries
from onemap_tools.bench.image_queries import Crop, asked, crops_of, run, summarise, table_lines
from onemap_tools.bench.mapping import MappedScene, map_scene
from onemap_tools.bench.queries import EXCLUDED_CLASSES
from tests.perception.toy import ColourEncoder, SeeingColours
from tests.simulator.scenes import box_room

SEED = 802  # even: the encoder's choices were made on such


@pytest.fixture(scope="module")
def encoder() -> MiniEncoder:
    return MiniEncoder(MiniParams())


@pytest.fixture(scope="module")
def mapped(encoder: MiniEncoder) -> MappedScene:
    return map_scene(generate_apartment(SEED, TRAINING), encoder, SEED, images=16)


@pytest.fixture(scope="module")
def crops(mapped: MappedScene) -> list[Crop]:
    return list(crops_of(mapped.scene, SEED))


def test_crops_of_mini_find_what_they_show_unless_the_map_is_shuffled(
    mapped: MappedScene, crops: list[Crop], encoder: MiniEncoder
) -> None:
    rates = summarise(list(asked(mapped, encoder, crops, SEED)), 0.3)
    assert rates["present"] > 20
    assert rates["near"] > 0.6
    store = mapped.belief.store
    order = np.random.default_rng(1).permutation(store.count)
    features = store.features(order)
    for first in range(0, store.count, len(store.blocks[0])):
        block = store.blocks[first // len(store.blocks[0])]
        part = features[first : first + len(block)]
        block[: len(part)] = part
    shuffled = summarise(list(asked(mapped, encoder, crops, SEED)), 0.3)
    assert shuffled["near"] < 0.4


def test_crops_are_large_enough_and_show_mostly_the_thing(crops: list[Crop]) -> None:
    assert len(crops) > 20
    assert all(min(crop.rgb.shape[:2]) >= image_queries.MIN_SIDE_PX for crop in crops)
    assert not {crop.category for crop in crops} & EXCLUDED_CLASSES


@pytest.fixture(scope="module")
def room() -> Scene:
    return box_room()


def test_what_an_apartment_has_not_counts_as_absent(room: Scene) -> None:
    encoder = SeeingColours()
    shown = map_scene(room, encoder, seed=3, images=12)
    red, blue = (np.full((16, 16, 3), colour, np.uint8) for colour in ((200, 0, 0), (0, 0, 200)))
    sofa, bed = asked(shown, encoder, [Crop("sofa", red), Crop("bed", blue)], 3)
    assert (sofa.present, sofa.near) == (True, True)
    assert (bed.present, bed.near, bed.by_chance) == (False, False, False)
    rates = summarise([sofa, bed], 0.3)
    assert (rates["sofas"], rates["sofas_near"], rates["absent"]) == (1, 1.0, 1)


def test_the_report_is_json_and_text(monkeypatch: pytest.MonkeyPatch, room: Scene) -> None:
    monkeypatch.setattr(image_queries, "generate_apartment", lambda seed, style: room)
    monkeypatch.setattr(image_queries, "make_encoder", lambda params: SeeingColours())
    done: list[int] = []
    document = run(MiniParams(), (800, 802), 3, done.append)
    assert (document["benchmark"], document["apartments"]) == ("image queries", 2)
    assert done == [1, 2]
    json.dumps(document, allow_nan=False)
    assert f"{document['present']} crops" in table_lines(document)[0]


def test_an_encoder_that_takes_no_images_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(image_queries, "make_encoder", lambda params: ColourEncoder())
    with pytest.raises(ValueError, match="the encoder toy takes no images"):
        run(MiniParams(), (800,), 3, print)
