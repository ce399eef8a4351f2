"""``python -m onemap_simulator``: run the simulator."""

from typing import Any

from onemap_shared.runner import ServiceParts, StartReport, run_service


def load(_start: StartReport) -> ServiceParts[Any]:
    """Import the service, which takes seconds."""
    from onemap_simulator.config import SimulatorConfig
    from onemap_simulator.service import build, check

    return ServiceParts(SimulatorConfig, build, check)


if __name__ == "__main__":
    run_service("simulator", load)
