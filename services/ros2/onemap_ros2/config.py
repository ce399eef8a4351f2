"""Configuration section ``ros2``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from onemap_shared.config import Endpoint
from onemap_shared.params import Params

TopicName = Annotated[str, Field(pattern=r"^/[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*$")]
FrameName = Annotated[str, Field(min_length=1, max_length=200)]


class TopicParams(Params):
    """The robot's topics; ``onemap ros2 topics`` lists what there is."""

    color: TopicName = Field(
        default="/camera/camera/color/image_raw",
        description="sensor_msgs/Image: rgb8, bgr8, rgba8, bgra8 or mono8; a RealSense's name.",
    )
    depth: TopicName = Field(
        default="/camera/camera/aligned_depth_to_color/image_raw",
        description="sensor_msgs/Image, 16UC1 (mm) or 32FC1 (m), registered to the color image: "
        "pixel by pixel the same view and size.",
    )
    camera_info: TopicName = Field(
        default="/camera/camera/color/camera_info",
        description="sensor_msgs/CameraInfo of the color image.",
    )
    odometry: TopicName = Field(
        default="/odom", description="nav_msgs/Odometry: where the base is and how it moves."
    )
    command: TopicName = Field(
        default="/cmd_vel", description="Twist or TwistStamped that the base obeys."
    )
    tf: TopicName = Field(default="/tf", description="Moving transforms; a namespace stands first.")
    tf_static: TopicName = Field(default="/tf_static", description="Fixed transforms, latched.")


class Ros2Config(Params):
    """The robot's ROS 2 network (rmw_zenoh), its topics and its frames."""

    connect: tuple[Endpoint, ...] = Field(
        default=("tcp/127.0.0.1:7447",),
        min_length=1,
        description="Zenoh endpoints of the robot's rmw_zenoh router (rmw_zenohd); its default is "
        "port 7447 of the robot. OneMap's services may use the same router.",
    )
    domain: int = Field(default=0, ge=0, le=232, description="ROS_DOMAIN_ID of the robot.")
    node: str = Field(
        default="onemap",
        pattern=r"^[A-Za-z_][A-Za-z0-9_]*$",
        description="Name in 'ros2 node list'; another one for a second adapter.",
    )
    topics: TopicParams = Field(
        default=TopicParams(), description="The robot's topics, with their namespace."
    )
    map_frame: FrameName = Field(
        default="map",
        description="Frame of the belief map: fixed in the world. 'odom' for a robot without "
        "localisation, whose map drifts with its odometry.",
    )
    rectified: bool = Field(
        default=False,
        description="The color image is rectified, so that the camera information's P holds and "
        "not its K. An image with lens distortion is taken as one without.",
    )
    command_type: Literal["auto", "Twist", "TwistStamped"] = Field(
        default="auto",
        description="Of the command topic; auto: what the robot's own node subscribes to. Jazzy "
        "robots mostly have Twist, later ones TwistStamped.",
    )
    command_frame: FrameName = Field(
        default="base_link", description="frame_id of a TwistStamped: the robot's base."
    )
    pair_tolerance_ms: float = Field(
        default=15.0,
        ge=0,
        le=200,
        description="Milliseconds by which the stamps of a color and a depth image may differ; "
        "half a period at 30 Hz, so that neighbours are not mixed.",
    )
    frame_rate_hz: float = Field(
        default=15.0,
        gt=0,
        le=60,
        description="Most frames per second that are passed on, the newest each time: perception "
        "uses no more, and a camera's 30 Hz would fill a link.",
    )
    transform_wait_ms: float = Field(
        default=200.0,
        ge=0,
        le=2000,
        description="Milliseconds that an image or odometry waits for its transform, then it is "
        "dropped and counted; localisation may publish at 10 Hz.",
    )
    stale_s: float = Field(
        default=0.5,
        gt=0,
        le=5,
        description="Seconds without odometry after which the robot is stopped: ten messages of "
        "the 20 Hz that the planner expects.",
    )
    stop_s: float = Field(
        default=0.5,
        ge=0,
        le=5,
        description="Seconds for which zero velocity is repeated at 10 Hz before silence: a lost "
        "message must not leave the robot driving.",
    )
