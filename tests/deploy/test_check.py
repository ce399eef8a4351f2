"""check.sh: every step fails on an engine with the defect that it is there to see."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.deploy.deployment import DEPLOY

SCRIPT = DEPLOY / "check.sh"


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["compose", "systemd", "zenohd"])
def test_each_step_holds_on_an_engine_that_works_and_fails_on_others(engine: str) -> None:
    result = subprocess.run(
        [SCRIPT, "--self-test", engine], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert "fails with each of its defects" in result.stdout


@pytest.mark.parametrize(
    ("engine", "there", "sentence"),
    [
        ("compose", "docker", "a project onemap-check exists"),
        ("systemd", "ps", "is there: use a machine without OneMap"),
        ("zenohd", "", "zenohd is not on the PATH"),
    ],
)
def test_it_refuses_what_is_not_its_own(
    engine: str, there: str, sentence: str, tmp_path: Path
) -> None:
    """Before it writes or starts anything."""
    if engine == "systemd":
        if os.geteuid() != 0:
            pytest.skip("only root gets so far")
        text = SCRIPT.read_text(encoding="utf-8")
        shutil.copytree(DEPLOY / "check", tmp_path / "check")
        part = tmp_path / "check/systemd.sh"
        found = part.read_text(encoding="utf-8").replace("/opt/onemap", str(tmp_path / "check"))
        part.write_text(found, encoding="utf-8")
        script = tmp_path / "check.sh"
        script.write_text(text, encoding="utf-8")
    else:
        script = SCRIPT
    stubs = tmp_path / "stubs"
    stubs.mkdir()
    if there:
        (stubs / there).write_text("#!/bin/sh\necho systemd\n", encoding="utf-8")
        (stubs / there).chmod(0o755)
    result = subprocess.run(
        ["bash", script, engine],
        env={
            **os.environ,
            "PATH": f"{stubs}{os.pathsep}/usr/bin{os.pathsep}/bin",
            "TMPDIR": str(tmp_path),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert (result.returncode, result.stdout) == (2, "")
    assert sentence in result.stderr
