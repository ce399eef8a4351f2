"""install.sh prints what it would do, and the files it would install exist."""

from __future__ import annotations

import shlex
import shutil
import subprocess

import pytest

from tests.deploy.deployment import DEPLOY
from tests.structure import ROOT

SCRIPT = DEPLOY / "systemd" / "install.sh"


def dry_run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(SCRIPT), "--dry-run", *arguments], capture_output=True, text=True, check=False
    )


def commands(*arguments: str) -> list[list[str]]:
    result = dry_run(*arguments)
    assert result.returncode == 0, result.stderr
    return [shlex.split(line, comments=True) for line in result.stdout.splitlines()]


def test_it_installs_every_unit_and_file() -> None:
    done = commands()
    sources = {part for command in done if command[:1] == ["install"] for part in command}
    expected = [
        *(DEPLOY / "systemd").glob("onemap*.service"),
        *(DEPLOY / "systemd").glob("onemap.target"),
        *(DEPLOY / "systemd").glob("*.d/*.conf"),
        *(DEPLOY / "config").glob("*.yaml"),
        *DEPLOY.glob("*.json5"),
    ]
    assert len(expected) > 10
    assert {str(path) for path in expected} <= sources
    enable = next(command for command in done if command[:2] == ["systemctl", "enable"])
    assert {"onemap.target", "onemap-mapper.service"} <= set(enable)


def test_what_it_reads_exists() -> None:
    for command in commands("--torch", "torch==2.13.0"):
        for part in command:
            if part.startswith(str(ROOT)):
                assert (ROOT / part.partition("[")[0]).exists(), part


def test_a_machine_that_only_perceives_installs_perception_alone() -> None:
    done = commands("--services", "perception")
    packages = [command[-1] for command in done if command[1:2] == ["install"]]
    assert f"{ROOT}[perception,minilm]" in packages
    units = [part for command in done for part in command if part.endswith(".service")]
    assert {unit.rpartition("/")[2] for unit in units} == {
        "onemap-perception.service",
        "onemap-perception@.service",  # of further robots; nothing starts it
    }


def test_each_further_robot_gets_a_perception_and_a_planner() -> None:
    def enabled(*arguments: str) -> set[str]:
        (command,) = (each for each in commands(*arguments) if each[:2] == ["systemctl", "enable"])
        return set(command[2:])

    assert enabled("--robots", "r2,r3") - enabled() == {
        f"onemap-{service}@{robot}.service"
        for service in ("perception", "planner")
        for robot in ("r2", "r3")
    }


def test_each_service_gets_a_user_of_its_own() -> None:
    users = {
        command[-1] for command in commands("--services", "router,mapper") if "useradd" in command
    }
    assert users == {"onemap-router", "onemap-mapper"}


@pytest.mark.parametrize(
    "arguments", [["--services", "toaster"], ["--colour"], ["--robots", "R 2"]]
)
def test_wrong_usage_is_reported(arguments: list[str]) -> None:
    result = dry_run(*arguments)
    assert result.returncode == 2
    assert "usage:" in result.stderr
    assert result.stdout == ""


def test_shellcheck_finds_nothing() -> None:
    if shutil.which("shellcheck") is None:
        pytest.skip("shellcheck is not installed")
    subprocess.run(["shellcheck", str(SCRIPT)], check=True)
