"""The processes of the benchmark: a robot, a stage that answers frames with fields, and a map.

``python -m onemap_tools.bench.transport.peers ROLE SETTINGS`` (JSON) runs until standard input is
closed and then prints what it counted as one line of JSON. Each process serves every stream.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from onemap_shared import keys
from onemap_shared.bus import ZenohBus, open_bus
from onemap_shared.config import BusConfig, LinkParams
from onemap_shared.messages import FeatureField, FrameReceipt, RgbdFrame
from onemap_tools.bench.transport.streams import Stream, load_stream

WAIT_S = 0.2


@dataclass(frozen=True, slots=True)
class PeerTask:
    """What a process of the benchmark is told.

    endpoint: of the router. stream: the .npz file of frames and fields. streams: robots at once,
    each with a namespace of its own. rate_hz: of each camera. encode_s: time that perception takes
    for a frame. link: of robot and perception.
    """

    endpoint: str
    stream: str
    streams: int
    rate_hz: float
    encode_s: float
    link: LinkParams

    def to_json(self) -> str:
        """For the command line."""
        return json.dumps({**asdict(self), "link": self.link.model_dump()})

    @classmethod
    def of_json(cls, text: str) -> PeerTask:
        """The task of a command line."""
        values = json.loads(text)
        return cls(**{**values, "link": LinkParams.model_validate(values["link"])})


class Peer:
    """One stream of one role, in a thread."""

    def __init__(self, bus: ZenohBus, task: PeerTask, stream: Stream) -> None:
        self.bus, self.task, self.stream = bus, task, stream
        self.ages: list[tuple[float, float]] = []  # when a field arrived, and its age in seconds

    def robot(self, stop: threading.Event) -> None:
        """Publish frames at the camera's rate."""
        frames = self.bus.publish(keys.ROBOT_RGBD)
        number, due_s = 0, time.monotonic()
        while not stop.wait(max(due_s - time.monotonic(), 0.0)):
            frames.put(self.stream.frame(number, time.time_ns()))
            number += 1
            due_s = max(due_s + 1.0 / self.task.rate_hz, time.monotonic() - 1.0)

    def perception(self, stop: threading.Event) -> None:
        """Answer each frame with its field, after the time of the encoder."""
        frames = self.bus.subscribe(keys.ROBOT_RGBD)
        receipts = self.bus.publish(keys.RGBD_RECEIPTS)
        fields = self.bus.publish(keys.FIELD)
        while not stop.is_set():
            frame: RgbdFrame | None = frames.take(WAIT_S)
            if frame is not None:
                receipts.put(FrameReceipt(frame.sequence, frame.stamp_ns))
                stop.wait(self.task.encode_s)
                fields.put(self.stream.field(frame))

    def mapper(self, stop: threading.Event) -> None:
        """Take fields and note how old they are."""
        fields = self.bus.subscribe(keys.FIELD)
        receipts = self.bus.publish(keys.FIELD_RECEIPTS)
        while not stop.is_set():
            field: FeatureField | None = fields.take(WAIT_S)
            if field is not None:
                age_s = (time.time_ns() - field.stamp_ns) * 1e-9
                receipts.put(FrameReceipt(field.sequence, field.stamp_ns))
                self.ages.append((time.monotonic(), age_s))


def main(role: str, task: PeerTask) -> dict[str, Any]:
    """Run every stream of this role until standard input is closed; what was counted."""
    stop, stream = threading.Event(), load_stream(Path(task.stream))
    peers, threads = [], []
    for number in range(task.streams):
        config = BusConfig(connect=(task.endpoint,), namespace=f"bench/r{number}", link=task.link)
        bus = open_bus(config, role, f"bench{number}", stop)
        assert bus is not None
        peers.append(Peer(bus, task, stream))
        work: Callable[[threading.Event], None] = getattr(peers[-1], role)
        threads.append(threading.Thread(target=work, args=(stop,), daemon=True))
    print("ready", flush=True)
    for thread in threads:
        thread.start()
    sys.stdin.read()
    stop.set()
    for thread in threads:
        thread.join()
    counted = [{"ages": peer.ages, "metrics": peer.bus.metrics()} for peer in peers]
    for peer in peers:
        peer.bus.close()
    return {"streams": counted, "cpu_s": time.process_time()}


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1], PeerTask.of_json(sys.argv[2]))), flush=True)
