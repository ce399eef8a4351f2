"""The systemd units: valid, watched, confined, and starting installed commands."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

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


@pytest.mark.parametrize("name", [*NAMES, "ros2"])
def test_each_is_watched_and_limited_as_in_compose(name: str) -> None:
    service = unit(name)
    assert 3 * HEARTBEAT_S <= float(service["WatchdogSec"][0]) <= HANG_S
    assert float(service["TimeoutStopSec"][0]) > STOP_LIMIT_S
    assert service["RestartPreventExitStatus"] == ["2"]  # a wrong configuration
    page = service["Documentation"][0].rpartition("/")[2]
    assert (DEPLOY / page).exists()
    if name in compose():
        assert compose()[name]["mem_limit"] == service["MemoryMax"][0].lower()
        weight = compose()[name]["cpu_shares"] / compose()["gateway"]["cpu_shares"]
        assert float(service.get("CPUWeight", ["100"])[0]) / 100 == weight
    # Without a GPU memory is never both writable and executable.
    for key in ("PrivateDevices", "PrivateUsers"):
        assert (key in service) != (name == "mapper")
    # But that of services that compile loops.
    compiles = name in {"mapper", "planner"}
    assert ("MemoryDenyWriteExecute" in service) != compiles == ("CacheDirectory" in service)


@pytest.mark.parametrize("name", ["perception", "planner"])
def test_a_further_robot_has_the_same_unit_with_keys_of_its_own(name: str) -> None:
    first, further = (settings(UNITS / f"onemap-{unit}.service") for unit in (name, f"{name}@"))
    different = {key for key in first | further if first.get(key) != further.get(key)}
    assert different - {"StateDirectory"} == {"Description", "Environment"}
    assert "ONEMAP__BUS__NAMESPACE=site/%i" in further["Environment"][0].split()
    if name == "planner":
        assert further["StateDirectory"] == ["onemap/planner-%i"]
