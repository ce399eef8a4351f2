"""Errors that simulator and replay report before they wait for a router, as real processes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.shared.test_bus import free_port

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("module", "section", "reason"),
    [
        ("onemap_simulator", "simulator: {scene: flat}", "scene 'flat' is unknown"),
        ("onemap_simulator.replay", "replay: {directory: nowhere}", "cannot read nowhere/frames"),
    ],
)
def test_what_cannot_be_opened_is_told_at_once(
    tmp_path: Path, module: str, section: str, reason: str
) -> None:
    config = tmp_path / "robot.yaml"
    config.write_text(f"bus: {{connect: [tcp/127.0.0.1:{free_port()}]}}\n{section}\n")
    command = [sys.executable, "-m", module, "--config", str(config)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 2
    assert reason in result.stderr
    assert "waiting for a router" not in result.stderr
