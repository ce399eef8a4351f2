"""Run the ROS 2 adapter: ``python -m onemap_ros2 --config FILE``."""

from onemap_ros2.config import Ros2Config
from onemap_ros2.service import build
from onemap_shared.runner import run_service

raise SystemExit(run_service("ros2", Ros2Config, build))
