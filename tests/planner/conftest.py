"""Fixtures of the planner's tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from onemap_planner.config import PlannerConfig
from tests.planner.simulated_services import SimulatedServices


@pytest.fixture
def services(tmp_path: Path) -> Iterator[SimulatedServices]:
    """A planner and the services around it, closed at the end."""
    simulated = SimulatedServices(PlannerConfig(state_dir=tmp_path))
    yield simulated
    simulated.planner.close()
