"""Frames of a ROS 2 bag in MCAP, as the ROS 2 adapter makes them of a running robot.

Topics and frames are those of the section ``ros2``: color and depth are paired by stamp and placed
by tf. The recorder's time takes the place of the clock; where it was set back, none passes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from onemap_ros2.cdr import COMPRESSED_IMAGE, IMAGE
from onemap_ros2.config import Ros2Config, TopicParams
from onemap_ros2.robot_input import RobotInput
from onemap_ros2.topic_list import needs
from onemap_shared.messages import RgbdFrame
from onemap_tools.recording.bag_file import CDR, CUT_OFF, BagError, BagReader

LONG_S = 10.0  # more than anything may wait
READ = ("tf_static", "tf", "camera_info", "depth_camera_info", "color", "depth")


def read_topics(config: Ros2Config) -> dict[str, tuple[str, str]]:
    """What is read of a bag, by the names of the settings: topic and type."""
    read = (need for need in needs(config) if need.setting in READ)
    return {need.setting: (need.topic, need.types[0]) for need in read}


@dataclass(slots=True)
class Ros2Bag:
    """A bag and how its topics are read; ``problems`` is complete after the last frame."""

    path: Path
    config: Ros2Config
    frames_read: int = 0
    problems: list[str] = field(default_factory=list)

    def frames(self) -> Iterator[RgbdFrame]:
        """All frames in the order of the recording; BagError if there is none."""
        robot, now_s, logged_ns = RobotInput(self.config), 0.0, None
        kinds = {topic: (kind, of) for kind, (topic, of) in read_topics(self.config).items()}
        types: dict[str, str] = {}
        bag = BagReader(self.path)
        for message in bag.messages():
            types.setdefault(message.topic, message.schema)
            if message.topic not in kinds:
                continue
            kind, ros_type = kinds[message.topic]
            if (message.encoding, message.schema) != (CDR, ros_type):
                raise BagError(
                    f"{message.topic} ({_setting(kind)}) in {self.path} is {message.schema} in "
                    f"{message.encoding}; it must be {ros_type} in {CDR}."
                )
            passed_ns = message.log_time_ns - (logged_ns or message.log_time_ns)
            now_s, logged_ns = now_s + max(passed_ns, 0) * 1e-9, message.log_time_ns
            robot.add(kind, message.data, now_s)
            yield from self._ready(robot, now_s)
        yield from self._ready(robot, now_s + LONG_S)  # what waits for a transform waits in vain
        if self.frames_read == 0:
            why = robot.problem or "no color and depth images have near stamps"
            sentence = self._lack(types) or f"No frame in {self.path}: {why}."
            raise BagError(f"{sentence} {CUT_OFF}" if bag.cut_off else sentence)
        for count, what in (
            (robot.unpaired, "images have no counterpart with a near stamp"),
            (robot.counts.clock_jumps, "times stamps jumped back: a clock was set, or was wrong"),
            (robot.counts.no_transform, "images or their depth have no transform at their stamp"),
            (robot.counts.unusable, f"messages cannot be used: {robot.problem}"),
        ):
            if count:
                self.problems.append(f"{count} {what}.")

    def _ready(self, robot: RobotInput, now_s: float) -> Iterator[RgbdFrame]:
        while (frame := robot.take_frame(now_s)) is not None:
            self.frames_read += 1
            yield frame

    def _lack(self, types: dict[str, str]) -> str:
        """Which topics are not in the bag, and which could be meant; empty if all are there."""
        lacks = []
        for kind, (name, ros_type) in read_topics(self.config).items():
            if name in types or kind == "tf_static":
                continue
            fits = (IMAGE, COMPRESSED_IMAGE) if kind in ("color", "depth") else (ros_type,)
            there = sorted(topic for topic, schema in types.items() if schema in fits)
            if kind == "tf":
                there = [topic for topic in there if not topic.endswith("_static")]
            meant = f"which may be {' or '.join(there)}" if there else "which must be recorded too"
            lacks.append(f"no {name} ({_setting(kind)}), {meant}")
        return f"{self.path} holds {'; '.join(lacks)}: see --config." if lacks else ""


def _setting(kind: str) -> str:
    """The setting that names a topic; that of tf follows from the namespace."""
    return f"ros2.topics.{kind}" if kind in TopicParams.model_fields else "ros2.namespace"
