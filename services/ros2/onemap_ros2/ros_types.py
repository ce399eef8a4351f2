"""Names of the ROS 2 types that the adapter uses."""

from __future__ import annotations

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED_IMAGE = "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
ODOMETRY = "nav_msgs/msg/Odometry"
TF = "tf2_msgs/msg/TFMessage"
CLOCK = "rosgraph_msgs/msg/Clock"
TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
NAVIGATE = "nav2_msgs/action/NavigateToPose"
GRID = "nav_msgs/msg/OccupancyGrid"
PATH = "nav_msgs/msg/Path"
MARKER_ARRAY = "visualization_msgs/msg/MarkerArray"
DETECTION_ARRAY = "vision_msgs/msg/Detection3DArray"

COMPRESSED = "/compressed"  # end of the names of topics as image_transport gives them
COMPRESSED_DEPTH = "/compressedDepth"


def image_type(topic: str) -> str:
    """The type of an image topic, by the name that image_transport gives it."""
    return COMPRESSED_IMAGE if topic.endswith((COMPRESSED, COMPRESSED_DEPTH)) else IMAGE
