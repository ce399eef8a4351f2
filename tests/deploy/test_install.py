"""install.sh in a root directory of its own, with stubs for what needs systemd or a network.

Everything else is real: versions, links, configuration, units.
"""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.deploy.deployment import DEPLOY
from tests.structure import ROOT

SCRIPT = DEPLOY / "systemd" / "install.sh"
STUBS = {
    # Logs its call; active when the file says so, but not while it starts. A unit crashes with the
    # versions that a file names, and starts slowly enough to be active once before.
    "systemctl": """
        version=$(readlink "$ONEMAP_INSTALL_ROOT/opt/onemap/current")
        case "$*" in
          is-active*) test -e "$STATE/active" && [ ! -e "$STATE/starting" ]; exit ;;
          restart*) touch "$STATE/starting" ;;
          reset-failed*) : > "$STATE/seconds" ;;
          show*)
            echo x >> "$STATE/seconds"; shift 7
            grep -qsx "${version##*/}" "$STATE/broken" ||
              [ "$(wc -l < "$STATE/seconds")" -lt 3 ] || rm -f "$STATE/starting"
            for unit; do
              state=active restarts=0
              grep -qsx "$unit" "$STATE/stopped" && state=inactive
              grep -qsx "${version##*/}" "$STATE/broken" &&
                [ "$(wc -l < "$STATE/seconds")" -gt 2 ] && restarts=1
              printf 'Id=%s\\nActiveState=%s\\nNRestarts=%s\\n\\n' "$unit" $state $restarts
            done ;;
        esac""",
    "systemd-run": 'while [ "$1" != -- ]; do shift; done; shift; exec "$@"',
    "systemd-sysusers": "exit 0",
    "systemd-tmpfiles": "exit 0",
    "runuser": 'while [ "$1" != -- ]; do shift; done; shift; exec "$@"',
    "sleep": "exit 0",
    # python3 -m venv FOLDER makes one with stubs of pip, onemap and python.
    "python3": """
        case "$1" in
          -c) echo "${PYTHON_VERSION:-3.11}" ;;
          -m) mkdir -p "$3/bin"; cp "$STUBS/pip" "$STUBS/onemap" "$3/bin/"
              cp "$STUBS/python" "$3/bin/" ;;
          *) echo ;;
        esac""",
    "pip": '[ ! -e "$STATE/no-network" ] || exit 1',
    "onemap": "exit 0",
    # Checks a service: one that cannot be imported, or says another version, is in a file.
    "python": """
        case "$*" in *torch*) echo torch==2.8+nv ;; esac
        case "$*" in *check_service*) ;; *) exit 0 ;; esac
        file=no-import sentence="cannot be imported"
        [ "$#" = 2 ] || file=silent sentence="does not say that it runs"
        ! grep -qsx "$2" "$STATE/$file" || { echo "the $2 $sentence"; exit 1; }""",
}


@dataclass(frozen=True)
class Machine:
    """A root directory, and what the stubs log and read."""

    root: Path
    state: Path
    stubs: Path

    def install(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        variables = {
            **os.environ,
            "PATH": f"{self.stubs}{os.pathsep}{os.environ['PATH']}",
            "ONEMAP_INSTALL_ROOT": str(self.root),
            "STATE": str(self.state),
            "STUBS": str(self.stubs),
            "SETTLE_S": "3",
            **environment,
        }
        command = ["bash", str(SCRIPT), *arguments]
        return subprocess.run(command, env=variables, capture_output=True, text=True, check=False)

    def installed(self, *arguments: str, **environment: str) -> str:
        result = self.install(*arguments, **environment)
        assert result.returncode == 0, result.stderr
        return result.stdout

    @property
    def log(self) -> list[str]:
        return (self.state / "log").read_text(encoding="utf-8").splitlines()

    @property
    def versions(self) -> set[str]:
        return {path.name for path in (self.root / "opt/onemap/versions").iterdir()}

    @property
    def current(self) -> str:
        return (self.root / "opt/onemap/current").resolve().name

    @property
    def units(self) -> set[str]:
        return {path.name for path in (self.root / "usr/local/lib/systemd/system").iterdir()}


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    made = Machine(tmp_path / "root", tmp_path / "state", tmp_path / "stubs")
    made.state.mkdir()
    made.stubs.mkdir()
    (made.state / "seconds").touch()
    for name, body in STUBS.items():
        stub = made.stubs / name
        log = 'echo "${0##*/} $*" >> "$STATE/log"'
        # A version is named by the second: the stub of date counts instead.
        stub.write_text(f"#!/bin/sh\n{log}\n{body}\n", encoding="utf-8")
        stub.chmod(0o755)
    date = made.stubs / "date"
    date.write_text('#!/bin/sh\necho x >> "$STATE/dates"; wc -l < "$STATE/dates" | tr -d " "\n')
    date.chmod(0o755)
    return made


def test_a_first_installation_has_units_configuration_and_says_how_to_start(
    machine: Machine,
) -> None:
    out = machine.installed()
    assert "Start with: systemctl start onemap.target" in out
    rollback = machine.install("--rollback")
    assert (rollback.returncode, "no version before" in rollback.stderr) == (1, True)
    assert machine.units >= {"onemap.target", "onemap-mapper.service", "onemap-.service.d"}
    assert "onemap-ros2.service" not in machine.units
    configuration = machine.root / "etc/onemap"
    shipped = {path.name for path in (DEPLOY / "config").rglob("*.yaml")}
    assert shipped <= {path.name for path in configuration.rglob("*.yaml")}
    assert (configuration / "router.json5").stat().st_mode & 0o777 == 0o644
    assert any(line.startswith("onemap --version") for line in machine.log)
    for name in ("mapper", "planner"):
        assert any(f"onemap_{name}.warm_up" in line for line in machine.log)
    page = machine.root / "opt/onemap/current/share/doc/onemap/jetson.md"
    assert page.exists()  # named by Documentation= of every unit


def test_an_update_switches_restarts_and_keeps_two_versions(machine: Machine) -> None:
    machine.installed()
    first = machine.current
    (machine.state / "active").touch()
    assert "have run for 3 s" in machine.installed()
    second = machine.current
    assert machine.versions == {first, second}
    assert "systemctl restart --no-block onemap.target" in machine.log
    machine.installed()
    assert machine.versions == {second, machine.current}
    machine.installed("--rollback")
    assert machine.current == second
    assert len(machine.versions) == 2


def test_an_installation_that_fails_or_does_not_start_leaves_the_old_one(machine: Machine) -> None:
    machine.installed()
    first = machine.current
    (machine.state / "active").touch()
    (machine.state / "no-network").touch()
    result = machine.install()
    assert result.returncode != 0
    assert "0.3.0 still runs" in result.stderr
    assert (machine.current, machine.versions) == (first, {first})
    assert not any("restart" in line for line in machine.log)
    (machine.state / "no-network").unlink()
    (machine.state / "no-import").write_text("planner\n", encoding="utf-8")
    result = machine.install()
    assert result.returncode == 1
    assert "the planner cannot be imported" in result.stdout
    assert (machine.current, machine.versions) == (first, {first})
    assert not any("restart" in line for line in machine.log)


def test_a_version_that_does_not_stay_up_goes_and_the_one_before_comes_back(
    machine: Machine,
) -> None:
    """Also if it crashes after a while or says nothing; it is never what a rollback goes to."""
    machine.installed()
    machine.installed()
    first, second = sorted(machine.versions, key=lambda name: int(name.rpartition("-")[2]))
    (machine.state / "active").touch()
    number = int(second.rpartition("-")[2])
    for defect, name, sentence in (
        ("broken", f"{second.rpartition('-')[0]}-{number + 1}", "crashed 3 s after the switch"),
        ("silent", "planner", "the planner does not say that it runs"),
    ):
        (machine.state / defect).write_text(f"{name}\n", encoding="utf-8")
        result = machine.install()
        assert result.returncode == 1
        assert sentence in result.stderr
        assert "does not work and was removed" in result.stderr
        assert (machine.current, machine.versions) == (second, {first, second})
        (machine.state / defect).unlink()
        if defect == "broken":  # while its services were still starting
            assert f"{second.split('-')[0]} runs again" in result.stderr
            assert "Start with" not in result.stdout
            assert "have run for 3 s" in result.stdout
    machine.installed("--rollback")
    assert machine.current == first


def test_a_service_that_stood_still_before_an_update_need_not_run_after_it(
    machine: Machine,
) -> None:
    machine.installed()
    (machine.state / "active").touch()
    for state in ("stopped", "silent"):
        (machine.state / state).write_text("planner\nonemap-planner.service\n", encoding="utf-8")
    machine.installed()


def test_extras_are_remembered_until_others_are_named(machine: Machine) -> None:
    machine.installed("--extras", "openclip")
    shown = machine.installed("--dry-run")
    machine.installed()
    installs = [line for line in machine.log if line.startswith("pip install")]
    assert sum(line.endswith(",openclip]") for line in installs) == 2
    assert sum(line.endswith("requirements/encoders.txt") for line in installs) == 2
    assert "openclip" in shown
    assert "requirements/encoders.txt" in shown
    machine.installed("--extras", "none")
    assert "openclip" not in machine.installed("--dry-run")


def test_an_edited_configuration_stays_and_the_new_one_lies_beside_it(machine: Machine) -> None:
    machine.installed()
    edited = machine.root / "etc/onemap/router-tls.json5"
    edited.write_text("mine", encoding="utf-8")
    assert "router-tls.json5.new" in machine.installed()
    assert edited.read_text(encoding="utf-8") == "mine"
    beside = edited.with_name("router-tls.json5.new")
    assert beside.read_bytes() == (DEPLOY / "router-tls.json5").read_bytes()
    assert not list((machine.root / "etc/onemap").glob("*.yaml.new"))


def test_what_a_narrower_call_leaves_out_is_disabled(machine: Machine) -> None:
    machine.installed("--robots", "r2")
    enable = [line for line in machine.log if line.startswith("systemctl enable")][-1]
    assert {"onemap-planner@r2.service", "onemap-perception@r2.service"} <= set(enable.split())
    machine.installed("--services", "router,planner")
    disabled = {line.split()[-1] for line in machine.log if line.startswith("systemctl disable")}
    assert disabled == {
        "onemap-perception.service",
        "onemap-perception@r2.service",
        "onemap-mapper.service",
        "onemap-planner@r2.service",
        "onemap-gateway.service",
    }
    assert "onemap-mapper.service" not in machine.units
    assert "onemap-planner.service" in machine.units


def test_removing_keeps_configuration_and_maps_unless_asked(machine: Machine) -> None:
    machine.installed()
    maps = machine.root / "var/lib/onemap/maps"
    maps.mkdir(parents=True)
    (machine.root / "opt/onemap/models").mkdir()
    for options, kept in (((), True), (("--purge",), False)):
        machine.installed("--uninstall", *options)
        assert any(line.startswith("systemctl disable --now onemap.target") for line in machine.log)
        assert (machine.root / "opt/onemap/models").exists() is kept
        assert not (machine.root / "opt/onemap/versions").exists()
        assert machine.units == set()
        assert maps.exists() is kept
        assert (machine.root / "etc/onemap/jetson.yaml").exists() is kept


def test_python_3_10_gets_pins_of_its_own(machine: Machine) -> None:
    machine.installed(PYTHON_VERSION="3.10")
    pins = (machine.root / "opt/onemap/current/pins.txt").read_text(encoding="utf-8")
    assert "numpy==1.26" in pins
    result = machine.install(PYTHON_VERSION="3.9")
    assert result.returncode == 2
    assert "Python 3.10, 3.11 or 3.12 is needed" in result.stderr


def test_a_wheel_of_torch_replaces_the_pinned_one(machine: Machine) -> None:
    machine.installed("--torch", "torch-2.8.whl")
    pins = (machine.root / "opt/onemap/current/pins.txt").read_text(encoding="utf-8")
    assert pins.endswith("torch==2.8+nv\n")  # so that pip takes no other
    assert pins.count("torch==") == 1
    assert any(line.startswith("pip install") and "torch-2.8.whl" in line for line in machine.log)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--robots", "R 2"], "no name for a robot: R 2"),
        (["--services", "mapper,camera"], "unknown service: camera"),
        (
            ["--services", "gateway", "--torch", "x.whl"],
            "--torch is for the mapper, which is not among --services",
        ),
        (["--nothing"], "unknown option: --nothing"),
        (["--services"], "--services needs a value"),
        (["--purge"], "--purge goes with --uninstall"),
        (["--extras", "camera"], "no extra of pyproject.toml: camera"),
    ],
)
def test_what_it_does_not_know_is_refused_before_anything_changes(
    machine: Machine, arguments: list[str], reason: str
) -> None:
    result = machine.install(*arguments)
    assert result.returncode == 2
    assert result.stderr.endswith(f"{reason}\n")
    assert not machine.root.exists()


def test_a_dry_run_changes_nothing(machine: Machine) -> None:
    out = machine.installed("--dry-run", "--robots", "r2")
    assert f"{ROOT}\\[perception" in out
    assert out.endswith("Nothing was changed (--dry-run).\n")
    assert not machine.root.exists()
