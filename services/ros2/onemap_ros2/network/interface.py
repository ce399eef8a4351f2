"""What the adapter needs of a robot's network, whatever its keys look like."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol


class Reader(Protocol):
    """The newest messages of a topic, encoded, oldest first."""

    def take(self) -> list[bytes]:
        """What came since the last call."""


class Writer(Protocol):
    """Sends encoded messages of one topic."""

    def put(self, data: bytes) -> None:
        """Send one message, with what ROS 2 expects beside it."""

    @property
    def has_subscribers(self) -> bool:
        """Whether anyone listens, as far as the network knows."""


class PendingCall(Protocol):
    """A question to a service that is under way."""

    @property
    def done(self) -> bool:
        """Whether it was answered, or never will be."""

    @property
    def reply(self) -> bytes | None:
        """The encoded answer; None while there is none, and if nobody answered in time."""


class ServiceRequest(Protocol):
    """A question to a service of our own."""

    def reply(self, data: bytes) -> None:
        """Answer it, once; ``data``: the encoded response."""


class RequestReader(Protocol):
    """The questions to a service of our own, oldest first."""

    def take(self) -> Sequence[ServiceRequest]:
        """What came since the last call."""


class RosNetwork(Protocol):
    """One ROS 2 node."""

    def read(
        self,
        topic: str,
        ros_type: str,
        depth: int,
        *,
        latched: bool = False,
        reliable: bool = False,
    ) -> Reader:
        """Follow a topic, keeping the newest ``depth`` messages; latched: also those of before.

        reliable: none may be lost on the way, and none comes from a best-effort publisher.
        """

    def write(self, topic: str, ros_type: str, *, latched: bool = False) -> Writer:
        """Announce a publisher of a topic; latched: who comes later gets the newest message."""

    def call(self, service: str, ros_type: str, request: bytes, timeout_s: float) -> PendingCall:
        """Ask a service, without waiting for its answer."""

    def serve(self, service: str, ros_type: str) -> RequestReader:
        """Offer a service."""

    def endpoints(self) -> tuple[Endpoint, ...]:
        """All publishers, subscribers and servers of the robot that are known now."""

    def wait(self, timeout_s: float) -> None:
        """Until a message or an answer arrives, at most ``timeout_s``."""

    def close(self) -> None:
        """Leave the network."""


class NetworkError(ConnectionError):
    """The robot's network cannot be joined; one sentence."""


PUBLISHER, SUBSCRIBER, SERVER, ACTION_SERVER = "MP", "MS", "SS", "AS"
SEND_GOAL = "/_action/send_goal"  # end of the name of the service that takes an action's goals


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A publisher, a subscriber or a server (``MP``, ``MS``, ``SS``), or an action's (``AS``).

    node: full name, such as ``/robot/camera``; empty if unknown. topic: or the service's name; with
    its outer slash. ros_type: ``pkg/msg/Type``. type_hash: ``RIHS01_`` and 64 digits; empty where
    the network has none. backends: whether the token lists buffer backends (Lyrical, Rolling).
    """

    kind: str
    node: str
    topic: str
    ros_type: str
    type_hash: str
    backends: bool = False
