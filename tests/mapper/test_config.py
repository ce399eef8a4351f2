"""The mapper's configuration: reasons for every default, and nonsense refused."""

from __future__ import annotations

import pytest
import torch
from pydantic import ValidationError

from onemap_mapper.config import MapperConfig


def test_every_default_says_why() -> None:
    for name, field in MapperConfig.model_fields.items():
        assert field.description, f"{name} has no description"


def test_the_default_threshold_means_a_few_good_frames() -> None:
    explored = 1 / MapperConfig().explored_variance
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
        {"explored_variance": float("nan")},
        {"cellsize": 0.1},
    ],
)
def test_nonsense_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        MapperConfig.model_validate(wrong)


def test_device_and_dtype_reach_the_map() -> None:
    settings = MapperConfig(device="cuda:1", feature_dtype="float16").settings()
    assert settings.device == torch.device("cuda:1")
    assert settings.feature_dtype == torch.float16
