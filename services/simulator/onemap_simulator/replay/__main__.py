"""Run the replay: ``python -m onemap_simulator.replay --config FILE``."""

from onemap_shared.runner import run_service
from onemap_simulator.replay.config import ReplayConfig
from onemap_simulator.replay.service import build, check

raise SystemExit(run_service("replay", ReplayConfig, build, check=check))
