"""``deploy/ros2``: what colcon installs, the launch file, and what RViz shows."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from unittest.mock import MagicMock
from xml.etree import ElementTree

import pytest
import yaml

from onemap_ros2 import cdr
from onemap_ros2.display import TOPICS
from tests.structure import ROOT, modules

PACKAGE = ROOT / "deploy" / "ros2"
MANIFEST = ElementTree.parse(PACKAGE / "package.xml").getroot()
SHOWS = {
    "Map": cdr.GRID,
    "MarkerArray": cdr.MARKER_ARRAY,
    "Path": cdr.PATH,
}


def test_rviz_shows_all_that_the_adapter_publishes_and_it_can() -> None:
    config = yaml.safe_load((PACKAGE / "rviz" / "onemap.rviz").read_text())
    displays = config["Visualization Manager"]["Displays"]
    shown = {each["Topic"]["Value"]: each for each in displays if "Topic" in each}
    types = {topic: SHOWS[each["Class"].split("/")[-1]] for topic, each in shown.items()}
    for_machines = {cdr.FILTER_INFO}
    assert types == {f"/onemap/{n}": k for n, k in TOPICS.items() if k not in for_machines}
    assert {each["Topic"]["Durability Policy"] for each in shown.values()} == {"Transient Local"}
    assert {each["Class"].split("/")[0] for each in displays} == {"rviz_default_plugins"}


def test_setup_and_manifest_agree_and_name_every_file(monkeypatch: pytest.MonkeyPatch) -> None:
    setuptools = MagicMock()
    monkeypatch.setitem(sys.modules, "setuptools", setuptools)
    monkeypatch.chdir(PACKAGE)
    runpy.run_path("setup.py")
    given = setuptools.setup.call_args.kwargs
    assert (given["name"], given["version"]) == tuple(
        MANIFEST.findtext(t) for t in ("name", "version")
    )
    assert f'version = "{given["version"]}"' in (ROOT / "pyproject.toml").read_text()
    assert (MANIFEST.get("format"), MANIFEST.findtext("export/build_type")) == ("3", "ament_python")
    installed = dict(given["data_files"])
    name = given["name"]
    assert installed["share/ament_index/resource_index/packages"] == [f"resource/{name}"]
    assert installed[f"share/{name}/launch"] == ["launch/onemap.launch.py"]
    assert installed[f"share/{name}/rviz"] == ["rviz/onemap.rviz"]
    assert all(Path(file).is_file() for files in installed.values() for file in files)
    assert all((Path(package) / "__init__.py").is_file() for package in given["packages"])


def test_colcon_finds_no_other_package_in_a_clone() -> None:
    """It takes each ``setup.py`` for one, and runs it."""
    scripts = [module.path for module in modules(ROOT) if module.path.name == "setup.py"]
    assert scripts
    for script in scripts:
        assert any((folder / "COLCON_IGNORE").is_file() for folder in script.parents), script
