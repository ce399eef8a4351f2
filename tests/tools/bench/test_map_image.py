"""The benchmark of the map image: what it draws, and what it times."""

from __future__ import annotations

from itertools import count

import numpy as np
import pytest

from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy, SearchView
from onemap_tools.bench import map_image
from tests.gateway.fakes import search_view


def test_each_scale_is_drawn_and_the_least_time_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(map_image, "view_of_apartment", lambda _seed: search_view("sofa"))
    times = (float(number**2) for number in count())  # each call takes longer than the one before
    small, large = map_image.run(1, (2, 8), 3, lambda: next(times))
    assert (small["pixels_per_cell"], large["pixels_per_cell"]) == (2, 8)
    assert (large["width"], large["height"]) == (4 * small["width"], 4 * small["height"])
    assert (small["draw_ms"], small["encode_ms"]) == (1e3, 13e3)
    assert large["kilobytes"] >= small["kilobytes"]


def test_scores_lie_on_what_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    states = np.array([[Occupancy.FREE, Occupancy.OCCUPIED, Occupancy.UNKNOWN]] * 20, np.uint8)

    class Belief:
        grid = GridSpec(0.1, (0, 0), states.shape)

        def occupancy_grid(self) -> np.ndarray:
            return states

    monkeypatch.setattr(map_image, "generate_apartment", lambda *_: None)
    monkeypatch.setattr(map_image, "driven", lambda *_: Belief())
    view: SearchView = map_image.view_of_apartment(3)
    assert np.isnan(view.similarity[:, 2]).all()
    assert ((view.similarity[:, :2] >= 0) & (view.similarity[:, :2] <= 1)).all()
    assert np.unique(view.similarity[:, 0]).size > 10
