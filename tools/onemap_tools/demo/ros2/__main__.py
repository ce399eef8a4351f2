"""The robot of ``onemap demo --ros2``: ``python -m onemap_tools.demo.ros2 --config FILE``."""

from __future__ import annotations

from onemap_shared.runner import run_service
from onemap_simulator.config import SimulatorConfig
from onemap_tools.demo.ros2.robot import NAME, build, check

raise SystemExit(run_service(NAME, SimulatorConfig, build, check=check, section="simulator"))
