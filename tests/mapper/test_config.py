"""The mapper's section: flat, one key per parameter, former keys explained."""

from __future__ import annotations

import pytest

from onemap_mapper.config import MapperConfig
from onemap_mapper.params import (
    CheckpointParams,
    ObjectParams,
    RegionParams,
    SubmapParams,
    VerdictParams,
)
from onemap_shared.config import ConfigError, section


def test_the_section_is_the_parameters_and_four_keys_of_the_service() -> None:
    groups = (CheckpointParams, RegionParams, VerdictParams, ObjectParams, SubmapParams)
    parameters = [name for group in groups for name in group.model_fields]
    own = {"threads", "map_folder", "map_quota_mb", "robots"}
    assert set(MapperConfig.model_fields) == {*parameters, *own}


@pytest.mark.parametrize(
    ("former", "now"),
    [("forgetting_per_s", "process_noise_per_s")],
)
def test_a_former_key_is_refused_with_its_new_name(former: str, now: str) -> None:
    with pytest.raises(ConfigError, match=f"mapper.{former} is now called '{now}'"):
        section({"mapper": {former: 0.1}}, "mapper", MapperConfig)


def test_a_wrong_key_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ConfigError, match="did you mean 'cell_size_m'"):
        section({"mapper": {"cellsize_m": 0.1}}, "mapper", MapperConfig)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"robots": ["fleet/r1", "fleet/r1"]}, "each robot once"),
        ({"robots": ["/r1"]}, "should match pattern"),
        ({"robots": ["r1"], "process_noise_per_s": 0.1}, "process_noise_per_s needs one clock"),
    ],
)
def test_robots_that_cannot_share_a_map_are_refused(
    values: dict[str, object], sentence: str
) -> None:
    with pytest.raises(ConfigError, match=sentence):
        section({"mapper": values}, "mapper", MapperConfig)
