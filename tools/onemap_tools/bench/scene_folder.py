"""The folder that a run of the scene benchmark leaves: its document and pictures of its map."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from onemap_gateway.present.render import Overlay, encode_png, render_map
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.query.replies import search_view
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery, text_query
from onemap_perception.encoders.protocol import Encoder
from onemap_tools.bench.place_labels import PlaceLabel
from onemap_tools.bench.place_report import within


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
