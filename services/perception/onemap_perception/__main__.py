"""``python -m onemap_perception``: run perception."""

from typing import Any

from onemap_shared.runner import ServiceParts, StartReport, run_service


def load(_start: StartReport) -> ServiceParts[Any]:
    """Import the service, which takes seconds."""
    from onemap_perception.config import PerceptionConfig
    from onemap_perception.service import build

    return ServiceParts(PerceptionConfig, build)


if __name__ == "__main__":
    run_service("perception", load)
