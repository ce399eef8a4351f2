from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.sleep import bed, pillow
from tests.simulator.generation.furniture.draws import draws, extents


def test_the_headboard_and_the_place_for_pillows_are_at_the_wall() -> None:
    for model in draws(bed):
        points = np.concatenate([part.mesh.vertices for part in model.parts])
        assert points[points[:, 2].argmax(), 1] > 0.9
        (top,) = model.support_surfaces
        assert 0.3 < top.y_min < top.y_max < model.upper[1]
        assert 0.35 < top.z < 0.65


def test_beds_are_single_or_double() -> None:
    widths = extents(draws(bed, 20))[:, 0]
    assert (widths < 1.15).any()
    assert (widths > 1.3).any()
    assert not ((widths > 1.15) & (widths < 1.3)).any()


def test_a_pillow_is_thickest_in_its_middle() -> None:
    for model in draws(pillow):
        points = np.concatenate([part.mesh.vertices for part in model.parts])
        thickness = np.abs(points[:, 2] - points[:, 2].mean())
        middle = np.linalg.norm(points[:, :2], axis=1) < 0.1
        assert thickness[middle].min() > 0.8 * thickness.max()
