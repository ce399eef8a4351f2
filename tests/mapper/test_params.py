"""Parameters: what the defaults mean, and impossible values."""

from __future__ import annotations

import pytest
import torch
from pydantic import ValidationError

from onemap_mapper.params import MapParams, OccupancyParams


def test_the_default_threshold_means_a_few_good_frames() -> None:
    explored = 1 / MapParams().explored_variance
    at_two_metres = 0.86  # the released model's confidence of a flat surface
    assert 2 <= explored / at_two_metres <= 4


@pytest.mark.parametrize(
    "wrong",
    [
        {"cell_size_m": 0},
        {"device": "gpu"},
        {"feature_dtype": "float64"},
        {"obstacle_min_height_m": 1.3},
        {"floor_tolerance_m": 0.2},
        {"process_noise_per_s": -1},
        {"depth_noise_m": -0.001},
        {"explored_variance": float("nan")},
        {"cellsize": 0.1},
        {"max_extent_m": 500},
        {"cell_size_m": 0.01},
    ],
)
def test_impossible_values_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        MapParams.model_validate(wrong)


@pytest.mark.parametrize(("cell_size_m", "levels"), [(0.1, 11), (0.05, 22), (0.25, 4), (1.0, 1)])
def test_voxels_are_about_as_high_as_a_cell_is_wide(cell_size_m: float, levels: int) -> None:
    assert OccupancyParams(cell_size_m=cell_size_m).levels == levels


def test_device_and_dtype_are_those_of_torch() -> None:
    params = MapParams(device="cuda:1", feature_dtype="float16")
    assert params.torch_device == torch.device("cuda:1")
    assert params.torch_dtype == torch.float16


@pytest.mark.parametrize(
    ("noise_m", "range_m"), [(0.005, 4.472), (0.0, 8.0), (0.001, 8.0), (0.02, 2.236)]
)
def test_obstacles_end_where_the_depth_is_as_uncertain_as_a_cell(
    noise_m: float, range_m: float
) -> None:
    params = OccupancyParams(depth_noise_m=noise_m)
    assert params.obstacle_range_m == pytest.approx(range_m, abs=1e-3)
