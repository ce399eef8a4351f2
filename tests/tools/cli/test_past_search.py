"""Past searches are listed and told step by step by a running gateway."""

from __future__ import annotations

from contextlib import closing

from typer.testing import CliRunner

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_OK
from tests.gateway.fakes import FakePlanner, past_search
from tests.memory_bus import MemoryRouter

RUNNER = CliRunner()


def test_a_running_robot_tells_its_past_searches() -> None:
    router = MemoryRouter()
    FakePlanner(router, past=[past_search()])
    with closing(build(router.bus("gateway"), GatewayConfig(port=0))) as worker:
        url = ["--url", f"http://127.0.0.1:{worker.port}"]
        listed = RUNNER.invoke(app, ["search", "list", *url])
        for text in ("2026-01-01 00:00:00", "sofa", "found", "10 s", "2.0 m", "s0"):
            assert text in listed.stdout
        told = RUNNER.invoke(app, ["search", "replay", "s0", *url])
        assert told.exit_code == EXIT_OK
        for text in (
            "Step 2 of 3, after 6.0 s, robot at (0.6, 0.5)",
            "sofa: approaching: walking up to what looks like a sofa",
            "Goal: detection at (1.0, 1.0).",
            "4 steps are left out.",
        ):
            assert text in told.stdout
