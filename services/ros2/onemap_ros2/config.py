"""Configuration section ``ros2``."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from onemap_shared.config import Endpoint
from onemap_shared.params import Params

TopicName = Annotated[str, Field(pattern=r"^/[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*$")]
COMPRESSED = "/compressed"  # end of the names of topics as image_transport gives them
COMPRESSED_DEPTH = "/compressedDepth"
NODE = "onemap"  # in 'ros2 node list'


class TopicParams(Params):
    """The robot's topics; ``onemap doctor`` names each that is missing."""

    color: TopicName = Field(
        default="/camera/camera/color/image_raw",
        description="sensor_msgs/Image: rgb8, bgr8, rgba8, bgra8 or mono8; a RealSense's name. "
        "Ending in /compressed: CompressedImage, JPEG or PNG.",
    )
    depth: TopicName = Field(
        default="/camera/camera/aligned_depth_to_color/image_raw",
        description="sensor_msgs/Image, 16UC1 (mm) or 32FC1 (m), registered to the color image: "
        "pixel by pixel the same view and size, as drivers or depth_image_proc make it. Ending in "
        "/compressedDepth or /compressed: CompressedImage, PNG.",
    )
    camera_info: TopicName | None = Field(
        default=None,
        description="sensor_msgs/CameraInfo of the color image. None: beside it, where drivers "
        "put it.",
    )
    odometry: TopicName = Field(
        default="/odom", description="nav_msgs/Odometry: where the base is and how it moves."
    )
    command: TopicName = Field(
        default="/cmd_vel", description="Twist or TwistStamped that the base obeys."
    )


class RobotTopics(NamedTuple):
    """The full names of all topics of a robot; ``navigate`` is nav2's action."""

    color: str
    depth: str
    camera_info: str
    odometry: str
    command: str
    navigate: str
    tf: str
    tf_static: str
    clock: str = "/clock"  # never in a namespace


class Ros2Config(Params):
    """The robot's ROS 2 network, its topics and its frames."""

    middleware: Literal["rmw_zenoh", "zenoh-bridge-ros2dds"] = Field(
        default="rmw_zenoh",
        description="What speaks Zenoh on the robot: ROS 2's own middleware rmw_zenoh, or the "
        "bridge beside a robot on DDS.",
    )

    connect: tuple[Endpoint, ...] = Field(
        default=("tcp/127.0.0.1:7447",),
        min_length=1,
        description="Zenoh endpoints of the robot's router (rmw_zenohd) or bridge; the default of "
        "both is port 7447 of the robot. OneMap's services may use the same router.",
    )
    domain: int = Field(
        default=0, ge=0, le=232, description="ROS_DOMAIN_ID of the robot; a bridge has its own."
    )
    namespace: str = Field(
        default="",
        pattern=r"^((/[A-Za-z_][A-Za-z0-9_]*)+)?$",
        description="Of a namespaced robot, such as /r1, or of the bridge: stands before every "
        "topic.",
    )
    tf_in_namespace: bool = Field(
        default=True,
        description="Whether /tf and /tf_static are in the namespace too, as nav2 and the bridge "
        "have it. False: all robots share one, and prefix their frames.",
    )
    use_sim_time: bool = Field(
        default=False,
        description="The robot's time is that of /clock, as its own nodes' use_sim_time.",
    )
    topics: TopicParams = Field(
        default=TopicParams(), description="The robot's topics, without their namespace."
    )
    map_frame: str = Field(
        default="map",
        min_length=1,
        max_length=200,
        description="Frame of the belief map: fixed in the world. 'odom' for a robot without "
        "localisation, whose map drifts with its odometry.",
    )
    rectified: bool = Field(
        default=False,
        description="The color image is rectified, so that the camera information's P holds and "
        "not its K. An image with lens distortion is taken as one without.",
    )
    drive: Literal["velocity", "nav2"] = Field(
        default="velocity",
        description="velocity: the planner's own velocities on the command topic. nav2: its goals "
        "by the action /navigate_to_pose, and nav2 drives: on the command topic only zeros are "
        "sent, while nav2 does not answer a cancellation.",
    )
    display: bool = Field(
        default=True, description="Publish /onemap/... for RViz and Foxglove while anyone listens."
    )

    @property
    def names(self) -> RobotTopics:
        """The topics with the robot's namespace before them."""
        beside = self.topics.color.removesuffix(COMPRESSED).rpartition("/")[0]
        topics = {
            **self.topics.model_dump(),
            "camera_info": self.topics.camera_info or f"{beside}/camera_info",
            "navigate": "/navigate_to_pose",
        }
        placed = {name: self.in_namespace(topic) for name, topic in topics.items()}
        tf = self.namespace if self.tf_in_namespace else ""
        return RobotTopics(**placed, tf=f"{tf}/tf", tf_static=f"{tf}/tf_static")

    @property
    def diagnostics(self) -> str:
        """One topic for all robots of a network; a bridge puts its namespace before it."""
        bridged = self.middleware == "zenoh-bridge-ros2dds"
        return self.in_namespace("/diagnostics") if bridged else "/diagnostics"

    def in_namespace(self, topic: str) -> str:
        """A topic with the robot's namespace before it."""
        return f"{self.namespace}{topic}"
