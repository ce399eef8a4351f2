"""Certificates in a folder: private keys are private, and what is there is kept."""

from __future__ import annotations

import json
from datetime import datetime, timezone
from pathlib import Path

import pytest
from typer.testing import CliRunner

pytest.importorskip("cryptography", reason="cryptography is not installed")

from onemap_shared.keys import ROLES
from onemap_tools.certificate_files import write_certificates
from onemap_tools.cli.app import app
from onemap_tools.errors import CliError

NOW = datetime(2026, 1, 1, tzinfo=timezone.utc)
NAMES = {"ca", "router", *ROLES}


def write(folder: Path) -> dict[str, bool]:
    return write_certificates(folder, ["robot.local"], now=NOW, days=30)


def test_every_role_gets_a_certificate_and_a_key_of_its_own(tmp_path: Path) -> None:
    assert write(tmp_path / "tls") == dict.fromkeys(NAMES, True)
    files = {path.name: path for path in (tmp_path / "tls").iterdir()}
    assert set(files) == {f"{name}.{suffix}" for name in NAMES for suffix in ("pem", "key")}
    assert {path.stat().st_mode & 0o777 for path in files.values() if path.suffix == ".key"} == {
        0o600
    }
    assert len({path.read_bytes() for path in files.values()}) == len(files)


def test_what_is_there_is_kept_and_what_is_missing_is_made(tmp_path: Path) -> None:
    write(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for suffix in ("pem", "key"):
        (tmp_path / f"planner.{suffix}").unlink()
    made = write(tmp_path)
    assert {name for name, new in made.items() if new} == {"planner"}
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert {name for name in before if before[name] != after[name]} == {
        "planner.pem",
        "planner.key",
    }


def test_half_of_a_pair_is_refused(tmp_path: Path) -> None:
    write(tmp_path)
    (tmp_path / "ca.key").unlink()
    with pytest.raises(CliError, match=r"ca\.key is missing"):
        write(tmp_path)


def test_an_authority_that_is_none_is_refused(tmp_path: Path) -> None:
    for suffix in ("pem", "key"):
        (tmp_path / f"ca.{suffix}").write_text("hello")
    with pytest.raises(CliError, match=r"ca\.key"):
        write(tmp_path)


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CliError, match="Cannot write"):
        write(tmp_path / "file" / "tls")


def test_the_command_says_what_it_made(tmp_path: Path) -> None:
    arguments = ["certs", str(tmp_path / "tls"), "--host", "robot.local"]
    first = CliRunner().invoke(app, arguments)
    assert first.exit_code == 0
    assert first.stdout.count(": made") == len(NAMES)
    assert "PRIVATE" not in first.stdout
    second = CliRunner().invoke(app, [*arguments, "--json"])
    assert json.loads(second.stdout)["made"] == dict.fromkeys(NAMES, False)
