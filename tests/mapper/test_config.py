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


def test_the_section_is_the_parameters_and_three_keys_of_the_service() -> None:
    groups = (CheckpointParams, RegionParams, VerdictParams, ObjectParams, SubmapParams)
    parameters = [name for group in groups for name in group.model_fields]
    assert set(MapperConfig.model_fields) == {*parameters, "threads", "map_folder", "map_quota_mb"}


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
