"""``python -m onemap_mapper``: run the mapper."""

from functools import partial
from typing import Any

from onemap_shared.runner import ServiceParts, StartReport, run_service


def load(start: StartReport) -> ServiceParts[Any]:
    """Import the service, which takes seconds."""
    from onemap_mapper.config import MapperConfig
    from onemap_mapper.service import build

    return ServiceParts(MapperConfig, partial(build, start=start))


if __name__ == "__main__":
    run_service("mapper", load)
