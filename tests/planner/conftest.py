"""Fixtures of the planner's tests."""

from collections.abc import Iterator

import pytest

from onemap_planner.config import PlannerConfig
from tests.planner.simulated_services import SimulatedServices


@pytest.fixture
def services() -> Iterator[SimulatedServices]:
    """A planner and the services around it, closed at the end."""
    simulated = SimulatedServices(PlannerConfig())
    yield simulated
    simulated.planner.close()
