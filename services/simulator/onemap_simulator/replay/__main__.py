"""``python -m onemap_simulator.replay``: run a recording in place of a robot."""

from typing import Any

from onemap_shared.runner import ServiceParts, StartReport, run_service


def load(_start: StartReport) -> ServiceParts[Any]:
    """Import the service, which takes seconds."""
    from onemap_simulator.replay.config import ReplayConfig
    from onemap_simulator.replay.service import build, check

    return ServiceParts(ReplayConfig, build, check)


if __name__ == "__main__":
    run_service("replay", load)
