"""OneMap and RViz: ``ros2 launch onemap_bringup onemap.launch.py config:=/path/robot.yaml``."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

STOP_S = "20"  # for the services to stop the robot and keep the map; a second signal kills them


def generate_launch_description() -> LaunchDescription:
    """All services of OneMap as one process group, and RViz unless it is not wanted."""
    rviz = PathJoinSubstitution([FindPackageShare("onemap_bringup"), "rviz", "onemap.rviz"])
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", description="OneMap's configuration, a path."),
            DeclareLaunchArgument(
                "onemap",
                default_value="onemap",
                description="The command, such as /opt/onemap/.venv/bin/onemap.",
            ),
            DeclareLaunchArgument("rviz", default_value="true", description="Whether RViz starts."),
            DeclareLaunchArgument("use_sim_time", default_value="false", description="Of RViz."),
            ExecuteProcess(
                cmd=[
                    LaunchConfiguration("onemap"),
                    "up",
                    "--config",
                    LaunchConfiguration("config"),
                ],
                name="onemap",
                output="screen",
                additional_env={"PYTHONPATH": ""},  # ROS's packages are not for OneMap's Python
                sigterm_timeout=STOP_S,
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", rviz],
                parameters=[{"use_sim_time": LaunchConfiguration("use_sim_time")}],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
