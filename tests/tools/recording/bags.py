"""A mapper on a bus in this process, and recordings of it; bags as rosbag2 writes them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import yaml
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_typestore

from onemap_mapper.config import MapperConfig
from onemap_mapper.service import Mapper, build
from onemap_ros2.config import Ros2Config
from onemap_shared import keys
from onemap_shared.messages import RgbdFrame
from onemap_tools.recording.bag_file import BagWriter
from onemap_tools.recording.record import BagRecorder, subscribed
from onemap_tools.recording.ros2_frames import read_topics
from tests.mapper import scenes
from tests.memory_bus import MemoryRouter
from tests.ros2.robot_messages import camera_info, image, transforms

SECOND_NS, MS = 10**9, 10**6


class RecordedRobot:
    """A mapper that is fed with frames of a room, and a recorder of what happens."""

    def __init__(self, folder: Path, *, images: bool = True) -> None:
        self.router = MemoryRouter()
        self.mapper_bus = self.router.bus("mapper")
        self.mapper: Mapper = build(self.mapper_bus, MapperConfig(map_folder=folder))
        self.bus = self.router.bus("robot")
        self.path = folder / "robot.mcap"
        self._frames = self.bus.publish(keys.ROBOT_RGBD)
        self._fields = self.bus.publish(keys.FIELD)
        self._images = images
        self.now_ns = SECOND_NS

    def begin(self) -> None:
        recording = self.router.bus("recorder")
        streams = subscribed(recording, images=self._images)
        self.writer = BagWriter(self.path, {"onemap": {"version": "1"}})
        self.recorder = BagRecorder(streams, self.writer)

    def see(self, *numbers: int, fused: bool = True) -> None:
        """Frames and their fields; the mapper takes the newest unless it is busy."""
        for number in numbers:
            pose = scenes.pose(-0.5 + 0.1 * number, 0.2, 0.5 * number)
            field = scenes.field(number, pose)
            rgb = np.full((*scenes.SIZE, 3), number, np.uint8)
            frame = RgbdFrame(
                number, field.stamp_ns, rgb, field.depth_mm, field.intrinsics, field.T_map_camera
            )
            self._frames.put(frame)
            self._fields.put(field)
            if fused:
                self.mapper.step(0.0)

    def update(self) -> None:
        """Record what came."""
        self.now_ns += SECOND_NS
        self.recorder.update(self.now_ns)

    def end(self) -> Path:
        self.update()
        self.writer.close({"ended": "stopped"})
        return self.path


T0 = 1_700_000_000_000_000_000
SIZE = (48, 64)
TOPICS = {"color": "/cam/color", "depth": "/cam/depth", "camera_info": "/cam/info"}
CONFIG = Ros2Config.model_validate({"topics": TOPICS})
Entry = tuple[int, str, bytes]  # ms after T0, setting of the topic, message


def drive(frames: int = 3, begin_ns: int = T0) -> list[Entry]:
    """A camera that moves 0.2 m a frame, which come every 100 ms; ``begin_ns``: its first stamp."""
    entries: list[Entry] = [
        (0, "tf_static", transforms(0, ("base_link", "camera", 0.2, 0.0))),
        (0, "camera_info", camera_info(begin_ns, SIZE[1], SIZE[0], 40.0)),
    ]
    for number in range(frames):
        ms = 100 * number
        rgb = np.full((*SIZE, 3), 50 + number, np.uint8)
        depth = np.full(SIZE, 1500, np.uint16)
        edge = ("map", "base_link", 0.2 * number, 0.0)
        entries += [
            (ms, "tf", transforms(begin_ns + ms * MS, edge)),
            (ms + 1, "color", image(begin_ns + ms * MS, rgb, "rgb8")),
            (ms + 2, "depth", image(begin_ns + ms * MS, depth, "16UC1")),
        ]
    return entries


def bag(path: Path, entries: Iterable[Entry], config: Ros2Config = CONFIG, **types: str) -> Path:
    """A file as rosbag2 writes it; ``types``: of topics that are not what they should be."""
    with open(path, "wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="a test")
        channels: dict[str, int] = {}
        for sequence, (ms, kind, data) in enumerate(entries):
            if kind not in channels:
                topic, ros_type = read_topics(config)[kind]
                schema = writer.register_schema(types.get(kind, ros_type), "ros2msg", b"")
                channels[kind] = writer.register_channel(topic, "cdr", schema)
            at_ns = T0 + ms * MS
            writer.add_message(channels[kind], at_ns, data, at_ns, sequence)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def rosbag2(
    folder: Path, entries: list[Entry], storage: StoragePlugin, mode: CompressionMode
) -> Path:
    """A folder of two files, by the writer of rosbags."""
    store, folders = get_typestore(Stores.ROS2_JAZZY), (folder / "bag_0", folder / "bag_1")
    names, half = [], len(entries) // 2
    for part, of_it in zip(folders, (entries[:half], entries[half:]), strict=True):
        writer = Rosbag2Writer(part, version=9, storage_plugin=storage)
        writer.set_compression(mode, CompressionFormat.ZSTD)
        with writer:
            connections = {
                kind: writer.add_connection(*read_topics(CONFIG)[kind], typestore=store)
                for kind in sorted({kind for _, kind, _ in of_it})
            }
            for ms, kind, data in of_it:
                writer.write(connections[kind], T0 + ms * MS, data)
        (file,) = (each for each in part.iterdir() if each.name != "metadata.yaml")
        names.append(file.rename(folders[0] / file.name).name)
    path = folders[0] / "metadata.yaml"
    metadata = yaml.safe_load(path.read_text(encoding="utf-8"))
    metadata["rosbag2_bagfile_information"]["relative_file_paths"] = names
    path.write_text(yaml.safe_dump(metadata), encoding="utf-8")
    return folders[0]
