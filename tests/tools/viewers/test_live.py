"""``onemap live`` as a process, beside a robot that maps."""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path

import pytest

pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install 'onemap[live]'")
pytest.importorskip("google.protobuf", reason="needs protobuf, which onnx brings")

from typer.testing import CliRunner

from onemap_tools.cli.app import app
from onemap_tools.errors import CliError
from onemap_tools.processes.launch import onemap_command
from onemap_tools.processes.network import any_free_port
from onemap_tools.viewers import foxglove_topics as topics
from onemap_tools.viewers.foxglove_server import FoxgloveServer
from onemap_tools.viewers.live import HOST, LiveOptions, listening
from tests.end_to_end.system import PATIENCE_S, START_S, System
from tests.tools.viewers.foxglove_client import FoxgloveClient

SHOWN = (topics.IMAGE, topics.OCCUPANCY, topics.SIMILARITY, topics.ROBOT, topics.MAP_STATE)


@pytest.mark.slow
@pytest.mark.timeout(180)
def test_a_viewer_sees_a_robot(tmp_path: Path) -> None:
    sections = {"simulator": {"seed": 1, "rgbd_hz": 4.0}}
    with System(tmp_path, ("simulator", "perception", "mapper"), sections) as system:
        fused = lambda: system.monitor.revision is not None  # noqa: E731
        system.until(fused, "frames are fused", START_S)
        port = any_free_port()
        arguments = ("--config", str(system.configuration), "--port", str(port), "--query", "bed")
        process = subprocess.Popen(
            onemap_command("live", *arguments),
            env=system.environment,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stderr is not None
            assert f"ws://{HOST}:{port}" in process.stderr.readline()
            with FoxgloveClient(port) as client:
                client.discover(len(topics.TYPED) + len(topics.JSON))
                client.subscribe(*SHOWN)
                waiting = set(SHOWN)
                while waiting:
                    waiting.discard(client.receive()[0])
            process.send_signal(signal.SIGTERM)
            assert process.wait(PATIENCE_S) == 0
        finally:
            process.kill()


def test_a_port_that_is_taken_is_one_sentence() -> None:
    other = FoxgloveServer(HOST, 0, "")
    try:
        with pytest.raises(CliError, match=f"Cannot listen on {HOST}:{other.port} .*--port"):
            listening(LiveOptions(port=other.port))
    finally:
        other.close()


def test_without_a_router_the_command_says_what_to_start(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("onemap_tools.viewers.live.CONNECT_S", 0.2)
    config = tmp_path / "c.yaml"
    config.write_text(f"bus: {{connect: [tcp/127.0.0.1:{any_free_port()}]}}\n")
    result = CliRunner().invoke(app, ["live", "--config", str(config)])
    assert result.exit_code == 1
    assert "No router at" in result.stderr
