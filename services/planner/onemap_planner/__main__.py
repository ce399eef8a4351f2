"""``python -m onemap_planner``: run the planner."""

from functools import partial
from typing import Any

from onemap_shared.runner import ServiceParts, StartReport, run_service


def load(start: StartReport) -> ServiceParts[Any]:
    """Import the service, which takes seconds."""
    from onemap_planner.config import PlannerConfig
    from onemap_planner.service import build

    return ServiceParts(PlannerConfig, partial(build, start=start))


if __name__ == "__main__":
    run_service("planner", load)
