"""``python -m onemap_gateway``: run the gateway."""

from typing import Any

from onemap_shared.runner import ServiceParts, StartReport, run_service


def load(_start: StartReport) -> ServiceParts[Any]:
    """Import the service, which takes seconds."""
    from onemap_gateway.config import GatewayConfig
    from onemap_gateway.service import build

    return ServiceParts(GatewayConfig, build)


if __name__ == "__main__":
    run_service("gateway", load)
