"""The mapper's configuration: reasons for every default, and nonsense refused."""

from __future__ import annotations

import pytest
import torch
from pydantic import ValidationError

from onemap_mapper.config import MapperConfig
from onemap_shared.config import ConfigError, section


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


@pytest.mark.parametrize(
    ("former", "now"),
    [("forgetting_per_s", "process_noise_per_s"), ("low_height_m", "clearing_height_m")],
)
def test_a_former_key_is_refused_with_its_new_name(former: str, now: str) -> None:
    with pytest.raises(ConfigError, match=f"mapper.{former} is now called '{now}'"):
        section({"mapper": {former: 0.1}}, "mapper", MapperConfig)


def test_device_and_dtype_are_those_of_torch() -> None:
    config = MapperConfig(device="cuda:1", feature_dtype="float16")
    assert config.torch_device == torch.device("cuda:1")
    assert config.torch_dtype == torch.float16
