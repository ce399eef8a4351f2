"""Frames of a ROS 2 bag, as the ROS 2 adapter makes them of a running robot.

rosbags reads the bag. Topics and frames are those of the section ``ros2``: color and depth are
paired by stamp and placed by tf. The recorder's time takes the place of the clock.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from onemap_ros2.cdr import COMPRESSED_IMAGE, IMAGE
from onemap_ros2.config import Ros2Config, TopicParams
from onemap_ros2.robot_input import RobotInput
from onemap_ros2.topic_list import needs
from onemap_shared.messages import RgbdFrame
from onemap_tools.recording.bag_file import BagError

LONG_S = 10.0  # more than anything may wait
READ = ("tf_static", "tf", "camera_info", "color", "depth")


def read_topics(config: Ros2Config) -> dict[str, tuple[str, str]]:
    """What is read of a bag, by the names of the settings: topic and type."""
    read = (need for need in needs(config) if need.setting in READ)
    return {need.setting: (need.topic, need.types[0]) for need in read}


@dataclass(slots=True)
class Ros2Bag:
    """A bag and how its topics are read; ``problems`` is complete after the last frame.

    lacks: which topics are not in it, and which could be meant instead, as a sentence.
    """

    path: Path
    config: Ros2Config
    frames_read: int = 0
    problems: list[str] = field(default_factory=list)
    lacks: str = ""

    def frames(self) -> Iterator[RgbdFrame]:
        """All frames in the order of the recording; BagError if there is none."""
        robot, now_s, first_ns = RobotInput(self.config), 0.0, None
        for kind, at_ns, data in self._messages():
            first_ns = at_ns if first_ns is None else first_ns
            now_s = (at_ns - first_ns) * 1e-9
            robot.add(kind, data, now_s)
            yield from self._ready(robot, now_s)
        yield from self._ready(robot, now_s + LONG_S)  # what waits for a transform waits in vain
        if self.frames_read == 0:
            why = robot.problem or "no color and depth images have near stamps"
            raise BagError(self.lacks or f"No frame in {self.path}: {why}.")
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

    def _messages(self) -> Iterator[tuple[str, int, bytes]]:
        """Setting of the topic, the recorder's time in nanoseconds and CDR of each message."""
        kinds = {topic: kind for kind, (topic, _) in read_topics(self.config).items()}
        try:
            store = get_typestore(Stores.LATEST)
            with AnyReader([self.path], default_typestore=store) as reader:
                self.lacks = self._check(reader.connections)
                wanted = [each for each in reader.connections if each.topic in kinds]
                for connection, at_ns, data in reader.messages(wanted) if wanted else ():
                    yield kinds[connection.topic], at_ns, data
        except BagError:
            raise
        except Exception as problem:  # of rosbags, sqlite3 and the decompressors
            raise BagError(
                f"{self.path} cannot be read as a bag of ROS 2: {str(problem).rstrip('.')}. If its "
                "recorder was killed, 'ros2 bag reindex FOLDER' or 'mcap recover FILE' mends it."
            ) from problem

    def _check(self, connections: Collection[Connection]) -> str:
        """``lacks``; BagError for topics of another type than they should have."""
        types = {each.topic: each.msgtype for each in connections}
        lacks = []
        for kind, (name, ros_type) in read_topics(self.config).items():
            if types.get(name, ros_type) != ros_type:
                raise BagError(
                    f"{name} ({_setting(kind)}) in {self.path} is {types[name]}; it must be "
                    f"{ros_type}."
                )
            if name in types or kind == "tf_static":
                continue
            fits = (IMAGE, COMPRESSED_IMAGE) if kind in ("color", "depth") else (ros_type,)
            there = sorted(topic for topic, of in types.items() if of in fits)
            if kind == "tf":
                there = [topic for topic in there if not topic.endswith("_static")]
            meant = f"which may be {' or '.join(there)}" if there else "which must be recorded too"
            lacks.append(f"no {name} ({_setting(kind)}), {meant}")
        return f"{self.path} holds {'; '.join(lacks)}: see --config." if lacks else ""


def _setting(kind: str) -> str:
    """The setting that names a topic; that of tf follows from the namespace."""
    return f"ros2.topics.{kind}" if kind in TopicParams.model_fields else "ros2.namespace"
