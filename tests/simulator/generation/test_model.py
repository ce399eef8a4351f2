from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import box
from onemap_simulator.generation.model import assemble, support_surface
from tests.simulator.generation.layouts import GREY


def test_a_model_spans_all_its_parts() -> None:
    model = assemble("box", (GREY, [box((1, 1, 1)), box((0.2, 0.2, 0.2), (2.0, 0.0, 1.5))]))
    np.testing.assert_allclose(model.lower, (-0.5, -0.5, 0.0))
    np.testing.assert_allclose(model.upper, (2.1, 0.5, 1.7))


def test_a_support_surface_keeps_its_margin_and_never_vanishes() -> None:
    assert support_surface(1.0, 0.6, 0.7) == (-0.46, -0.26, 0.46, 0.26, 0.7)
    narrow = support_surface(0.05, 0.6, 0.7)
    assert narrow.x_min < narrow.x_max
