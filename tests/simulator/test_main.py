"""Errors that simulator and replay report before they wait for a router, as real processes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.shared.test_bus import free_port

pytestmark = pytest.mark.slow


def run(module: str, folder: Path, section: str) -> subprocess.CompletedProcess[str]:
    config = folder / "robot.yaml"
    config.write_text(f"bus: {{connect: [tcp/127.0.0.1:{free_port()}]}}\n{section}\n")
    command = [sys.executable, "-m", module, "--config", str(config)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_a_scene_that_cannot_be_opened(tmp_path: Path) -> None:
    result = run("onemap_simulator", tmp_path, "simulator: {scene: flat}")
    assert result.returncode == 2
    assert "scene 'flat' is unknown" in result.stderr
    assert "waiting for a router" not in result.stderr


def test_a_folder_without_a_recording(tmp_path: Path) -> None:
    result = run("onemap_simulator.replay", tmp_path, f"replay: {{directory: {tmp_path}}}")
    assert result.returncode == 2
    assert f"cannot read {tmp_path / 'frames.json'}" in result.stderr
    assert "waiting for a router" not in result.stderr
