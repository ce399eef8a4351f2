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
        description="sensor_msgs/Image: rgb8, bgr8, rgba8, bgra8 or mono8; a RealSense's name. "
        "Ending in /compressed: CompressedImage, JPEG or PNG.",
    )
    depth: TopicName = Field(
        default="/camera/camera/aligned_depth_to_color/image_raw",
        description="sensor_msgs/Image, 16UC1 (mm) or 32FC1 (m), registered to the color image: "
        "pixel by pixel the same view and size; else depth_camera_info is needed. Ending in "
        "/compressedDepth or /compressed: CompressedImage, PNG.",
    )
    depth_camera_info: TopicName | None = Field(
        default=None,
        description="sensor_msgs/CameraInfo of a depth image that is not registered to the color "
        "image: it is registered here, by both cameras and the transform between them. None: it "
        "is registered already.",
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
    tf: TopicName = Field(default="/tf", description="Moving transforms.")
    tf_static: TopicName = Field(default="/tf_static", description="Fixed transforms, latched.")
    clock: TopicName = Field(
        default="/clock", description="Simulated time, for use_sim_time; never in a namespace."
    )
    goal_pose: TopicName = Field(
        default="/goal_pose", description="geometry_msgs/PoseStamped, for drive: goal_pose."
    )
    navigate: TopicName = Field(
        default="/navigate_to_pose",
        description="nav2_msgs/NavigateToPose, an action, for drive: nav2.",
    )


class Nav2Params(Params):
    """How the planner's goals become goals of nav2, for drive: nav2 and drive: goal_pose."""

    goal_change_m: float = Field(
        default=0.4,
        gt=0,
        le=10,
        description="Metres by which the planner's goal must move before the robot's is replaced: "
        "each one makes nav2 plan anew, and ends of paths move by a few cells at each plan.",
    )
    goal_change_rad: float = Field(
        default=0.6,
        gt=0,
        le=3.2,
        description="Radians by which its heading must turn for that: a third of a camera's view.",
    )
    goal_period_s: float = Field(
        default=1.0,
        gt=0,
        le=60,
        description="Least seconds between two goals: nav2's behaviour tree plans once a second.",
    )
    retry_s: float = Field(
        default=3.0,
        gt=0,
        le=60,
        description="Seconds after a goal that nav2 refused, aborted or reached, before the same "
        "one is sent again, if the planner still has it.",
    )
    max_plan_age_s: float = Field(
        default=1.5,
        gt=0,
        le=10,
        description="Seconds since the planner's last plan after which the goal is cancelled: it "
        "plans four times a second, and not while its map or its odometry is too old.",
    )
    max_command_age_s: float = Field(
        default=0.6,
        gt=0,
        le=10,
        description="Seconds since the planner's last velocity, a sign of life here, after which "
        "the goal is cancelled: twice the time that a velocity holds.",
    )
    answer_s: float = Field(
        default=2.0,
        gt=0,
        le=60,
        description="Seconds that nav2 has to answer to a goal or a cancellation, which is asked "
        "for again then; its own default.",
    )


class DisplayParams(Params):
    """What is published for RViz and Foxglove, on topics of our own."""

    enabled: bool = Field(default=True, description="False: nothing is published for display.")
    prefix: TopicName = Field(
        default="/onemap",
        description="Of these topics: belief, similarity, markers, detections, path and goal.",
    )
    map_rate_hz: float = Field(
        default=1.0,
        gt=0,
        le=5,
        description="Most grids per second, and only while anyone listens: each is a question to "
        "the mapper and a message of one byte per cell.",
    )
    marker_rate_hz: float = Field(
        default=2.0,
        gt=0,
        le=10,
        description="Most markers, detections and paths per second; the planner plans four times.",
    )


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
        "topic of topics and display.",
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
    drive: Literal["velocity", "nav2", "goal_pose"] = Field(
        default="velocity",
        description="velocity: the planner's own velocities on the command topic. nav2: its goals "
        "by the action NavigateToPose, and nav2 drives. goal_pose: the same as messages, for what "
        "has no action; it cannot be cancelled, a goal where the robot stands replaces it. With "
        "the last two nothing is ever sent on the command topic.",
    )
    nav2: Nav2Params = Field(default=Nav2Params(), description="For drive: nav2 or goal_pose.")
    display: DisplayParams = Field(
        default=DisplayParams(), description="What is published for RViz and Foxglove."
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
        description="Seconds for which zero velocity is repeated at 10 Hz before silence, longer "
        "if the process is held up: a lost message must not leave the robot driving.",
    )

    @property
    def names(self) -> TopicParams:
        """The topics with the robot's namespace before them."""
        shared = {"clock"} if self.tf_in_namespace else {"clock", "tf", "tf_static"}
        named = {
            setting: self.in_namespace(topic)
            for setting, topic in self.topics
            if topic is not None and setting not in shared
        }
        return self.topics.model_copy(update=named)

    def in_namespace(self, topic: str) -> str:
        """A topic with the robot's namespace before it."""
        return f"{self.namespace}{topic}"
