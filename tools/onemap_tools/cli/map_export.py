"""Writes the map of a running robot to a file; its ending says in which format."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from onemap import Client, QueryOptions
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra
from onemap_tools.map_export.geojson import feature_collection
from onemap_tools.map_export.layers import MapLayer
from onemap_tools.map_export.map_arrays import MapArrays, read_archive
from onemap_tools.map_export.ply import point_cloud
from onemap_tools.map_export.rasters import layer_image, nav2_pgm, nav2_yaml, world_file

ENDINGS = (".npz", ".png", ".yaml", ".geojson", ".ply")
ONE_TEXT = (".npz", ".png", ".ply")
MAX_REGIONS = 100


def export_map(
    gateway: Client, file: Path, *, texts: Sequence[str], layer: MapLayer
) -> dict[str, Any]:
    """Write the map; returns path and size of what was written, one file or two."""
    ending = file.suffix.lower()
    check(ending, texts)
    files = _contents(gateway, file, texts, layer)
    for path, content in files.items():
        try:
            path.write_bytes(content)
        except OSError as problem:
            raise CliError(f"Cannot write {path}: {problem.strerror}.") from problem
    others = [str(path) for path in files if path != file]
    size = sum(map(len, files.values()))
    return {"path": str(file), "file_bytes": size, **({"beside": others} if others else {})}


def check(ending: str, texts: Sequence[str]) -> None:
    """Raise CliError unless a file with this ending can hold the similarity to these texts."""
    if ending not in ENDINGS:
        raise CliError(
            f"A map is written to a file that ends in {', '.join(ENDINGS)}, not {ending!r}.",
            EXIT_USAGE_ERROR,
        )
    if ending in ONE_TEXT and len(texts) > 1:
        raise CliError(f"A {ending} file holds the similarity to one --text.", EXIT_USAGE_ERROR)


def _contents(
    gateway: Client, file: Path, texts: Sequence[str], layer: MapLayer
) -> Mapping[Path, bytes]:
    """What to write where."""
    ending = file.suffix.lower()
    if ending == ".geojson":
        answers = gateway.query_all(texts, QueryOptions(MAX_REGIONS)) if texts else ()
        document = feature_collection(answers, gateway.objects())
        return {file: json.dumps(document, indent=1).encode()}
    content = gateway.maps.archive(texts[0] if texts else "")
    if ending == ".npz":
        return {file: content}
    arrays = read_archive(content)
    if ending == ".ply":
        return {file: point_cloud(arrays)}
    if ending == ".yaml":
        image = file.with_suffix(".pgm")
        return {file: nav2_yaml(arrays, image.name).encode(), image: nav2_pgm(arrays)}
    return {file: _png(arrays, layer), file.with_suffix(".pgw"): world_file(arrays).encode()}


def _png(arrays: MapArrays, layer: MapLayer) -> bytes:
    with requires_extra("gateway", "A PNG file"):
        import cv2
    try:
        image = layer_image(arrays, layer)
    except ValueError as problem:
        raise CliError(f"{str(problem).capitalize()}.", EXIT_USAGE_ERROR) from problem
    _, encoded = cv2.imencode(".png", image)
    content: bytes = encoded.tobytes()
    return content
