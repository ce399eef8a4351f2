"""``python -m onemap_gateway``: the gateway's process."""

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_shared.runner import run_service

if __name__ == "__main__":
    raise SystemExit(run_service("gateway", GatewayConfig, build))
