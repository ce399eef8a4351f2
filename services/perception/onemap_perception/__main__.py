"""Run perception: ``python -m onemap_perception --config FILE``."""

from onemap_perception.config import PerceptionConfig
from onemap_perception.service import build
from onemap_shared.runner import run_service

raise SystemExit(run_service("perception", PerceptionConfig, build))
