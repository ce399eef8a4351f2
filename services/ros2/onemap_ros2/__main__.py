"""``python -m onemap_ros2``: run the ROS 2 adapter."""

from typing import Any

from onemap_shared.runner import ServiceParts, StartReport, run_service


def load(_start: StartReport) -> ServiceParts[Any]:
    """Import the service, which takes seconds."""
    from onemap_ros2.config import Ros2Config
    from onemap_ros2.service import build

    return ServiceParts(Ros2Config, build)


if __name__ == "__main__":
    run_service("ros2", load)
