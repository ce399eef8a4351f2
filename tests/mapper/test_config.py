"""The mapper's section: what the owner of a robot sets, and the map that it makes."""

from __future__ import annotations

import pytest

from onemap_mapper.config import MapperConfig
from onemap_mapper.params import MapParams
from onemap_shared.config import ConfigError, section


def test_the_defaults_of_the_section_are_those_of_the_map() -> None:
    assert MapperConfig().map == MapParams()


def test_a_depth_camera_that_sees_less_far_ends_features_and_occupancy() -> None:
    near = MapperConfig(depth_range_m=6.0).map
    assert (near.max_feature_range_m, near.occupancy_range_m) == (6.0, 6.0)
    far = MapperConfig(depth_range_m=30.0).map
    assert (far.max_feature_range_m, far.occupancy_range_m) == (30.0, 8.0)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"cellsize_m": 0.1}, "did you mean 'cell_size_m'"),
        ({"cell_size_m": 0.01}, "greater than or equal to 0.05"),
        ({"device": "gpu"}, "should match pattern"),
        ({"depth_noise_m": -0.001}, "greater than or equal to 0"),
        ({"max_feature_range_m": 6.0}, "is now called 'depth_range_m'"),
        ({"robots": ["fleet/r1", "fleet/r1"]}, "each robot once"),
        ({"robots": ["/r1"]}, "should match pattern"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(values: dict[str, object], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        section({"mapper": values}, "mapper", MapperConfig)


@pytest.mark.parametrize(
    ("noise_m", "range_m"), [(0.005, 4.472), (0.0, 8.0), (0.001, 8.0), (0.02, 2.236)]
)
def test_obstacles_end_where_the_depth_is_as_uncertain_as_a_cell(
    noise_m: float, range_m: float
) -> None:
    params = MapParams(depth_noise_m=noise_m)
    assert params.obstacle_range_m == pytest.approx(range_m, abs=1e-3)
