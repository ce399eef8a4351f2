"""The systemd units: valid, watched, confined, and starting installed commands."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

from onemap_shared.runner import HANG_S, HEARTBEAT_S
from onemap_shared.watchdog import STOP_LIMIT_S
from onemap_tools.processes.services import CORE
from tests.deploy.deployment import COMMON, DEPLOY, UNITS, compose, settings

NAMES = ("router", *CORE)
STUBS = ("sysinit.target", "basic.target", "shutdown.target", "network.target", "multi-user.target")


def unit(name: str) -> dict[str, list[str]]:
    """A service's settings, its own and the common ones."""
    own, common = settings(UNITS / f"onemap-{name}.service"), settings(COMMON)
    assert not own.keys() & common.keys() - {"Environment"}, "the common file would win"
    return {**common, **own}


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A file system with the units, what they start, and systemd's own targets as stubs."""
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not installed (Debian package systemd)")
    units = tmp_path / "etc/systemd/system"
    shutil.copytree(UNITS, units)
    for stub in STUBS:
        (units / stub).write_text("[Unit]\nDescription=stub\n", encoding="utf-8")
    command = tmp_path / "opt/onemap/current/bin/onemap"
    command.parent.mkdir(parents=True)
    command.write_text("#!/bin/sh\n", encoding="utf-8")
    command.chmod(0o755)
    return tmp_path


def test_systemd_accepts_every_unit(root: Path) -> None:
    further = [f"onemap-{name}@r2.service" for name in ("perception", "planner")]
    units = [f"onemap-{name}.service" for name in NAMES] + further + ["onemap.target"]
    verify = ["systemd-analyze", "verify", "--man=no", f"--root={root}", *units]
    result = subprocess.run(verify, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""


def test_the_common_settings_reach_every_service(root: Path) -> None:
    security = [
        "systemd-analyze",
        "security",
        "--offline=true",
        "--threshold=25",  # tenths; a service without any confinement has 96
        f"--root={root}",
    ]
    for name in (*NAMES, "perception@r2", "planner@r2"):
        command = [*security, f"onemap-{name}.service"]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize("name", NAMES)
def test_each_is_watched_restarts_within_limits_and_is_confined(name: str) -> None:
    service = unit(name)
    expected = {
        "Restart": "always",
        "RestartPreventExitStatus": "2",
        "User": "%p",  # the unit's own name: a user for each service
        "NoNewPrivileges": "yes",
        "ProtectSystem": "strict",
        "CapabilityBoundingSet": "",
        "WantedBy": "onemap.target",
        "SystemCallErrorNumber": "EPERM",
        "Type": "notify",
        "NotifyAccess": "main",
    }
    assert {key: service[key] for key in expected} == {k: [v] for k, v in expected.items()}
    assert service["SystemCallFilter"] == ["@system-service", "~@privileged"]
    assert int(service["StartLimitBurst"][0]) > 0
    assert int(service["TasksMax"][0]) > 0
    assert compose()[name]["mem_limit"] == service["MemoryMax"][0].lower()
    assert 3 * HEARTBEAT_S <= float(service["WatchdogSec"][0]) <= HANG_S
    uses_gpu = "SupplementaryGroups" in service
    assert uses_gpu == (name == "mapper")
    # Without a GPU memory is never both writable and executable.
    for key in ("MemoryDenyWriteExecute", "PrivateDevices", "PrivateUsers"):
        assert (key in service) != uses_gpu


@pytest.mark.parametrize("name", [*NAMES, "ros2"])
def test_each_may_end_by_itself_and_names_a_page_that_is_installed(name: str) -> None:
    service = unit(name)
    assert float(service["TimeoutStopSec"][0]) > STOP_LIMIT_S
    page = service["Documentation"][0].removeprefix("file:/opt/onemap/current/share/doc/onemap/")
    assert (DEPLOY / page).exists()


def test_no_two_services_write_the_same_folder() -> None:
    folders = {name: unit(name).get("StateDirectory") for name in NAMES}
    assert {name: folder for name, folder in folders.items() if folder} == {
        "mapper": ["onemap/maps"],
        "planner": ["onemap/planner"],
    }
    configuration = yaml.safe_load((DEPLOY / "config" / "jetson.yaml").read_text(encoding="utf-8"))
    assert configuration["mapper"]["map_folder"] == "/var/lib/onemap/maps"
    assert configuration["planner"]["state_dir"] == "/var/lib/onemap/planner"


@pytest.mark.parametrize("name", NAMES)
def test_each_starts_its_service_with_files_that_are_installed(name: str) -> None:
    service = unit(name)
    executable, command, *arguments = shlex.split(service["ExecStart"][0])
    assert executable == "/opt/onemap/current/bin/onemap"
    assert command == name
    variables = dict(
        assignment.split("=", 1)
        for path in (COMMON, UNITS / f"onemap-{name}.service")
        for line in settings(path).get("Environment", [])
        for assignment in shlex.split(line)
    )
    file = variables[arguments[1].strip("${}")]
    installed = [*(DEPLOY / "config").glob("*.yaml"), *DEPLOY.glob("*.json5")]
    assert file in {f"/etc/onemap/{path.name}" for path in installed}


@pytest.mark.parametrize("name", ["perception", "planner"])
def test_a_further_robot_has_the_same_unit_with_keys_of_its_own(name: str) -> None:
    first, further = (settings(UNITS / f"onemap-{unit}.service") for unit in (name, f"{name}@"))
    different = {key for key in first | further if first.get(key) != further.get(key)}
    assert different - {"StateDirectory"} == {"Description", "Environment"}
    assert "ONEMAP__BUS__NAMESPACE=site/%i" in further["Environment"][0].split()
    if name == "planner":
        assert further["StateDirectory"] == ["onemap/planner-%i"]
