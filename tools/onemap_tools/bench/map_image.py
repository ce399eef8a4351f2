"""How long the gateway takes to draw the map of an apartment, and to encode the image."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, TypeVar

import cv2
import numpy as np

from onemap_gateway.present.render import Overlay, encode_png, render_map
from onemap_mapper.config import MapperConfig
from onemap_shared.geometry import F32
from onemap_shared.messages import Occupancy, SearchView
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_tools.bench.occupancy import driven

T = TypeVar("T")
PATCH_CELLS = 8  # between the scores that are drawn; smooth in between, as blurred features are


def run(
    seed: int, scales: Sequence[int], repeats: int, clock: Callable[[], float] = time.process_time
) -> Iterator[dict[str, Any]]:
    """A row for each scale, in pixels per cell: the size, and the least times in ms, one core."""
    view = view_of_apartment(seed)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        for scale in scales:
            draw = partial(render_map, view, Overlay(), scale)
            draw_ms, drawn = _least_ms(draw, repeats, clock)
            encode_ms, data = _least_ms(partial(encode_png, drawn.image), repeats, clock)
            height, width = drawn.image.shape[:2]
            yield {
                "pixels_per_cell": drawn.pixels_per_cell,
                "width": width,
                "height": height,
                "draw_ms": draw_ms,
                "encode_ms": encode_ms,
                "kilobytes": round(len(data) / 1e3),
            }
    finally:
        cv2.setNumThreads(threads)


def view_of_apartment(seed: int) -> SearchView:
    """The map after a drive through a generated apartment; its scores are drawn by the seed."""
    belief = driven(generate_apartment(seed, TRAINING), 0.0, seed, MapperConfig())
    occupancy = belief.occupancy_grid()
    similarity = _scores(occupancy.shape, np.random.default_rng(seed))
    similarity[occupancy == Occupancy.UNKNOWN] = np.nan
    return SearchView("sofa", 1, 1, 1, belief.grid, occupancy, np.zeros_like(occupancy), similarity)


def _scores(shape: tuple[int, ...], rng: np.random.Generator) -> F32:
    """Smooth scores (nx, ny) in [0, 1]."""
    nx, ny = shape
    coarse = rng.random((nx // PATCH_CELLS + 2, ny // PATCH_CELLS + 2), dtype=np.float32)
    return np.asarray(cv2.resize(coarse, (ny, nx)), np.float32)


def _least_ms(make: Callable[[], T], repeats: int, clock: Callable[[], float]) -> tuple[float, T]:
    """The least time of several calls in ms, and the last result."""
    times_s, result = [], None
    for _ in range(repeats):
        began_s = clock()
        result = make()
        times_s.append(clock() - began_s)
    assert result is not None
    return round(1e3 * min(times_s), 1), result
