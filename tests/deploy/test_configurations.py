"""Every configuration that ships is one that every service accepts."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from onemap_shared.config import read, section
from tests.deploy.deployment import CONFIGURATIONS, DEPLOY, models


def test_the_deployments_that_are_promised_are_there() -> None:
    names = {path.stem for path in CONFIGURATIONS}
    assert names == {"demo", "workstation", "jetson", "split-perception", "shared-map"}


@pytest.mark.parametrize("path", CONFIGURATIONS, ids=lambda path: path.stem)
def test_every_section_is_valid_for_its_service(path: Path) -> None:
    sections = read(path, environment={})
    for name, model in models().items():
        section(sections, name, model)


def test_state_lies_where_units_and_volumes_put_it() -> None:
    for name in ("workstation", "jetson", "shared-map"):
        document = yaml.safe_load((DEPLOY / "config" / f"{name}.yaml").read_text(encoding="utf-8"))
        for place in (document["mapper"]["map_folder"], document["planner"]["state_dir"]):
            assert Path(place).is_relative_to("/var/lib/onemap")
