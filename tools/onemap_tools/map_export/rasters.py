"""Images of one pixel per cell, x to the right, y up: layers, and nav2's map files."""

from __future__ import annotations

import numpy as np
import yaml

from onemap_shared.geometry import U8
from onemap_shared.messages import Layer, Occupancy
from onemap_tools.map_export.layers import MapLayer
from onemap_tools.map_export.map_arrays import MapArrays

# Of nav2's map server in trinary mode: p = (255 - pixel) / 255, compared with the thresholds.
FREE_PIXEL, OCCUPIED_PIXEL, UNKNOWN_PIXEL = 254, 0, 205
FREE_THRESHOLD, OCCUPIED_THRESHOLD = 0.196, 0.65  # unknown, 0.196078, is not below


def layer_image(arrays: MapArrays, layer: MapLayer) -> U8:
    """The image (ny, nx) uint8 of a layer; of the similarity (ny, nx, 4), opaque where observed.

    Occupancy as in ``nav2_pgm``; the other masks 255 where set; the score 0 to 1 as grey 0 to 255.
    ValueError for the similarity of a map without a text.
    """
    if layer is MapLayer.OCCUPANCY:
        return _upright(_occupancy_pixels(arrays))
    if layer is not MapLayer.SIMILARITY:
        return _upright(arrays.mask(Layer[layer.name]).astype(np.uint8) * np.uint8(255))
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
    image = _upright(_occupancy_pixels(arrays))
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


def _occupancy_pixels(arrays: MapArrays) -> U8:
    pixels = np.full(arrays.occupancy.shape, UNKNOWN_PIXEL, np.uint8)
    pixels[arrays.occupancy == Occupancy.FREE] = FREE_PIXEL
    pixels[arrays.occupancy == Occupancy.OCCUPIED] = OCCUPIED_PIXEL
    return pixels


def _upright(values: U8) -> U8:
    """Grid values (nx, ny, ...) as an image (ny, nx, ...): its first row has the largest y."""
    image: U8 = np.ascontiguousarray(np.swapaxes(values, 0, 1)[::-1])
    return image
