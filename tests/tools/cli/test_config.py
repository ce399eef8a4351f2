"""``onemap config``: show, check and schema; every section has a model, every key a reason."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from onemap_shared.config import SECTIONS
from onemap_tools.cli.app import app
from onemap_tools.cli.config_report import installed_models
from onemap_tools.errors import EXIT_OK, EXIT_USAGE_ERROR
from tests.structure import ROOT

RUNNER = CliRunner()


def run(*arguments: str) -> Any:
    return RUNNER.invoke(app, ["config", *arguments])


def written(folder: Path, text: str) -> str:
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_what_is_shown_is_a_configuration(tmp_path: Path) -> None:
    shown = run("show")
    assert shown.exit_code == EXIT_OK
    sections = yaml.safe_load(shown.stdout)
    assert "replay" not in sections  # without a file the robot is the simulator
    config = written(tmp_path, shown.stdout)
    assert run("check", "--config", config).exit_code == EXIT_OK
    assert yaml.safe_load(run("show", "--config", config).stdout) == sections


def test_the_environment_overrides_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = written(tmp_path, "gateway: {port: 1234, token: hunter2}\nlog: {level: debug}\n")
    monkeypatch.setenv("ONEMAP__GATEWAY__PORT", "4321")
    shown = run("show", "--config", config)
    sections = yaml.safe_load(shown.stdout)
    assert sections["gateway"]["port"] == 4321
    assert sections["log"] == {
        "format": "human",
        "level": "debug",
    }
    assert "simulator" not in sections  # this file is of a real robot
    assert "hunter2" not in shown.output
    assert json.loads(run("show", "--config", config, "--json").stdout) == sections


def test_every_mistake_is_reported_in_a_sentence(tmp_path: Path) -> None:
    config = written(
        tmp_path,
        "planner: {explore: {object_limit_s: 0}, costmp: {}}\ngateway: {token: [hunter2]}\n"
        "simulator: {sede: 1}\nreplay: {}\nmaper: {}\nbus: loopback\n",
    )
    result = run("check", "--config", config, "--json")
    assert result.exit_code == EXIT_USAGE_ERROR
    document = json.loads(result.stdout.splitlines()[-1])
    assert document["ok"] is False
    assert document["exit_code"] == EXIT_USAGE_ERROR
    printed = result.stderr.splitlines()
    assert document["mistakes"] == printed
    assert len(printed) == 7
    for part in (
        "planner.explore.object_limit_s",
        "did you mean 'costmap'",
        "did you mean 'seed'",
        "both robots",
        "did you mean 'mapper'",
        "section 'bus' must be a mapping",
    ):
        assert part in result.stderr
    assert "gateway.token" in result.stderr
    assert "hunter2" not in result.output


def test_no_mistake_is_ok() -> None:
    assert run("check").stdout == "OK\n"
    document = json.loads(run("check", "--json").stdout.splitlines()[-1])
    assert document == {"ok": True, "checked": list(SECTIONS), "not_checked": {}}


def test_the_schema_is_of_all_sections_or_of_one() -> None:
    document = json.loads(run("schema", "--json").stdout)
    assert tuple(document["properties"]) == SECTIONS
    references = {entry["$ref"].rpartition("/")[2] for entry in document["properties"].values()}
    assert references <= set(document["$defs"])
    text = run("schema", "mapper").stdout
    assert text.startswith("mapper: ")
    assert "planner" not in text
    wrong = run("schema", "maper")
    assert wrong.exit_code == EXIT_USAGE_ERROR
    assert "no section 'maper'" in wrong.stderr


def test_only_sections_of_installed_extras_are_checked(tmp_path: Path) -> None:
    """All but the mapper, in a process whose imports of torch fail."""
    config = written(tmp_path, "mapper: {}\nplanner: {}\n")
    commands = [
        ["check", "--config", config],
        ["show", "--config", config],
        ["schema"],
        ["schema", "mapper"],
    ]
    code = (
        "import json, sys; sys.modules['torch'] = None\n"
        "from tests.tools.cli.test_config import run\n"
        f"results = [run(*command) for command in {commands!r}]\n"
        "print(json.dumps([[r.exit_code, r.stdout, r.stderr] for r in results]))\n"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True
    )
    checked, shown, listed, missing = json.loads(process.stdout)
    assert checked[0] == EXIT_OK
    assert "mapper is not checked here" in checked[1]
    assert "pip install -e '.[mapper]'" in checked[1]
    assert "planner" in yaml.safe_load(shown[1])
    assert "mapper is left out" in shown[1]
    assert "planner.explore.object_limit_s" in listed[1]
    assert missing[0] == EXIT_USAGE_ERROR
    assert "pip install -e '.[mapper]'" in missing[2]


def test_every_key_of_the_configuration_is_in_the_text() -> None:
    text = run("schema").stdout
    for model in installed_models().known.values():
        assert [key for key in model.model_fields if f".{key}: " not in text] == []
    assert 'log.format: "human" or "json", default "human"' in text
    assert "mapper.cell_size_m: number >= 0.05 and <= 1, default 0.1" in text
    assert "perception.encoder.model: text, required" in text
    assert "perception.detector with backend coco: " in text
