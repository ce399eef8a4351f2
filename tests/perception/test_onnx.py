"""Sessions of onnxruntime: no telemetry, and an error for a damaged file."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from onemap_perception.onnx import open_session

ENCODE = """
import numpy as np
from onemap_perception.config import MiniParams
from onemap_perception.encoders.mini import MiniEncoder
MiniEncoder(MiniParams()).encode(np.zeros((48, 64, 3), np.uint8))
"""


@pytest.mark.slow
def test_nothing_is_kept_for_sending(tmp_path: Path) -> None:
    """With its telemetry on, onnxruntime queues events in a database below the home folder."""
    listed = {name: value for name, value in os.environ.items() if not name.startswith("ORT_")}
    listed.pop("CI", None)  # which would silence it by itself
    quiet = {**listed, "HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    subprocess.run([sys.executable, "-c", ENCODE], env=quiet, check=True, timeout=60)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_a_file_that_is_no_network_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mini.onnx"
    path.write_bytes(b"not a network")
    with pytest.raises(ValueError, match="onnx"):
        open_session(path, threads=1)


def test_a_provider_that_this_build_lacks_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import onnxruntime

    monkeypatch.setattr(onnxruntime, "get_available_providers", lambda: ["CPUExecutionProvider"])
    with pytest.raises(ValueError, match="built without tensorrt"):
        open_session(tmp_path / "none.onnx", threads=1, provider="tensorrt")
