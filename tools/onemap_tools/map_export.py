"""Writes the map of a running robot to a file, in the format that its ending names."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import yaml

from onemap import Client
from onemap_shared.geometry import F32, U8
from onemap_shared.messages import Layer, Occupancy
from onemap_tools.cli.map import MapLayer
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra

ENDINGS = (".npz", ".png", ".yaml")
# Of nav2's map server in trinary mode: p = (255 - pixel) / 255, compared with the thresholds.
FREE_PIXEL, OCCUPIED_PIXEL, UNKNOWN_PIXEL = 254, 0, 205
FREE_THRESHOLD, OCCUPIED_THRESHOLD = 0.196, 0.65  # unknown, 0.196078, is not below
PIXELS = np.array([UNKNOWN_PIXEL, FREE_PIXEL, OCCUPIED_PIXEL], np.uint8)  # by occupancy


def export_map(gateway: Client, file: Path, *, text: str, layer: MapLayer) -> dict[str, Any]:
    """Write the map; returns path and size of what was written, one file or two."""
    files = _contents(gateway, file, text, layer)
    for path, content in files.items():
        try:
            path.write_bytes(content)
        except OSError as problem:
            raise CliError(f"Cannot write {path}: {problem.strerror}.") from problem
    others = [str(path) for path in files if path != file]
    size = sum(map(len, files.values()))
    return {"path": str(file), "file_bytes": size, **({"beside": others} if others else {})}


def _contents(gateway: Client, file: Path, text: str, layer: MapLayer) -> Mapping[Path, bytes]:
    """What to write where; CliError for another ending."""
    ending = file.suffix.lower()
    if ending not in ENDINGS:
        raise CliError(
            f"A map is written to a file that ends in {', '.join(ENDINGS)}, not {ending!r}.",
            EXIT_USAGE_ERROR,
        )
    content = gateway.maps.archive(text)
    if ending == ".npz":
        return {file: content}
    arrays = read_archive(content)
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
    return bytes(cv2.imencode(".png", image)[1])


@dataclass(frozen=True, slots=True)
class MapArrays:
    """occupancy and layers (nx, ny) uint8, similarity (nx, ny) float32 or (0, 0) without a text.

    Indexed [ix, iy]; origin_m: x, y in metres of the lower left corner of cell [0, 0].
    """

    occupancy: U8
    layers: U8
    similarity: F32
    origin_m: tuple[float, float]
    cell_size_m: float


def read_archive(content: bytes) -> MapArrays:
    """The arrays of an archive; raises ValueError if it is none."""
    try:
        archive = np.lib.npyio.NpzFile(io.BytesIO(content), allow_pickle=False)
        x_m, y_m = archive["origin_m"].tolist()
        arrays = MapArrays(
            archive["occupancy"],
            archive["layers"],
            archive["similarity"],
            (x_m, y_m),
            float(archive["cell_size_m"]),
        )
    except (KeyError, OSError, ValueError, TypeError, BadZipFile) as problem:
        raise ValueError(f"what the gateway sent is no map: {problem}") from problem
    if arrays.occupancy.shape != arrays.layers.shape or arrays.occupancy.ndim != 2:
        raise ValueError(f"the map's layers have shapes that differ: {arrays.layers.shape}")
    return arrays


def layer_image(arrays: MapArrays, layer: MapLayer) -> U8:
    """The image (ny, nx) uint8 of a layer; of the similarity (ny, nx, 4), opaque where observed.

    Occupancy as in ``nav2_pgm``; the other masks 255 where set; the score 0 to 1 as grey 0 to 255.
    ValueError for the similarity of a map without a text.
    """
    if layer is MapLayer.OCCUPANCY:
        return _occupancy_image(arrays)
    if layer is not MapLayer.SIMILARITY:
        return _upright(np.where(arrays.layers & Layer[layer.name], np.uint8(255), np.uint8(0)))
    if arrays.similarity.size == 0:
        raise ValueError("the similarity is to a text: give one with --text")
    seen = np.isfinite(arrays.similarity)
    grey = np.rint(np.where(seen, arrays.similarity, 0.0) * 255).astype(np.uint8)
    return _upright(np.stack([grey, grey, grey, seen * np.uint8(255)], axis=-1))


def world_file(arrays: MapArrays) -> str:
    """The six lines of a world file: where the centre of the upper left pixel lies, in metres."""
    size, (x_m, y_m) = arrays.cell_size_m, arrays.origin_m
    top_m = y_m + arrays.occupancy.shape[1] * size
    values = (size, 0.0, 0.0, -size, x_m + size / 2, top_m - size / 2)
    return "".join(f"{value:.10g}\n" for value in values)


def nav2_pgm(arrays: MapArrays) -> bytes:
    """The occupancy as nav2's map server reads it: a binary PGM."""
    image = _occupancy_image(arrays)
    return b"P5\n%d %d\n255\n" % (image.shape[1], image.shape[0]) + image.tobytes()


def nav2_yaml(arrays: MapArrays, image_name: str) -> str:
    """The description beside the PGM."""
    document = {
        "image": image_name,
        "mode": "trinary",
        "resolution": arrays.cell_size_m,
        "origin": [arrays.origin_m[0], arrays.origin_m[1], 0.0],
        "negate": 0,
        "occupied_thresh": OCCUPIED_THRESHOLD,
        "free_thresh": FREE_THRESHOLD,
    }
    text: str = yaml.safe_dump(document, sort_keys=False)
    return text


def _occupancy_image(arrays: MapArrays) -> U8:
    return _upright(PIXELS[np.minimum(arrays.occupancy, Occupancy.OCCUPIED)])


def _upright(values: U8) -> U8:
    """Grid values (nx, ny, ...) as an image (ny, nx, ...): its first row has the largest y."""
    image: U8 = np.ascontiguousarray(np.swapaxes(values, 0, 1)[::-1])
    return image
