"""A service whose main loop raises ends by itself with code 1, so that it is restarted."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import pytest

from onemap_shared.services import SERVICES
from onemap_tools.processes.services import CORE
from tests.end_to_end.system import PATIENCE_S, System

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

# The service itself, but its main loop raises at the fifth step, with all its threads running.
BREAKING = """
import runpy, sys
from dataclasses import replace
from onemap_shared import runner

class Breaking:
    def __init__(self, worker):
        self.worker, self.steps = worker, 0
        self.health, self.close = worker.health, worker.close
    def step(self, timeout_s):
        self.steps += 1
        if self.steps == 5:
            raise RuntimeError("broken")
        self.worker.step(timeout_s)

run = runner.run_service
def breaking(service, load):
    def loaded(start):
        parts = load(start)
        return replace(parts, build=lambda bus, config: Breaking(parts.build(bus, config)))
    run(service, loaded)

runner.run_service = breaking
runpy.run_module(sys.argv.pop(1), run_name="__main__", alter_sys=True)
"""


@pytest.fixture(scope="module")
def router_only(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """A router without services."""
    with System(tmp_path_factory.mktemp("system"), (), {}) as system:
        yield system


@pytest.mark.parametrize("service", CORE)
def test_a_service_that_raises_ends_by_itself(router_only: System, service: str) -> None:
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            BREAKING,
            SERVICES[service].module,
            "--config",
            str(router_only.configuration),
        ],
        env=router_only.environment,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    with process.stderr as log:
        said = next((line for line in log if "crashed" in line), "")
        assert f"{service} crashed" in said
        assert "RuntimeError: broken" in log.read()
    assert process.wait(PATIENCE_S) == 1  # 3 s on cores of its own
