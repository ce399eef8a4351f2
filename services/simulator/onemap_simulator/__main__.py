"""Run the simulator: ``python -m onemap_simulator --config FILE``."""

from onemap_shared.runner import run_service
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.service import build, check

raise SystemExit(run_service("simulator", SimulatorConfig, build, check=check))
