"""Habitat's robot in simulated time: the searches of the benchmark command it over a bus.

Commands, odometry and frames travel as the messages of a robot in real time, encoded and decoded,
one after the other in one thread: the same episode gives the same result.
"""

from __future__ import annotations

from typing import TypeVar

from onemap_shared.geometry import F64, Velocity2d
from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import RgbdFrame, VelocityCommand
from onemap_shared.transport import Subscription
from onemap_tools.bench.habitat.params import HabitatRobotParams
from onemap_tools.bench.habitat.robot import HabitatRobot
from onemap_tools.bench.habitat.world import World
from onemap_tools.bench.simulated_stamps import stamp_of

M = TypeVar("M")


class LockstepHabitatRobot:
    """Implements ``Robot`` of the lockstep simulation; a new one for each episode."""

    def __init__(self, world: World, params: HabitatRobotParams) -> None:
        router = MemoryRouter()
        bus = router.bus()
        self._commands = bus.publish(ROBOT_CMD_VEL)
        self._odometry = bus.subscribe(ROBOT_ODOMETRY)
        self._frames = bus.subscribe(ROBOT_RGBD)
        self._robot = HabitatRobot(router.bus(), world, params, now_s=0.0)
        self._sequence = 0
        self._robot.publish_odometry(stamp_of(0.0))
        self._last = _received(self._odometry)

    @property
    def adapter(self) -> HabitatRobot:
        """The robot on the other side of the bus, with what only the benchmark may know."""
        return self._robot

    @property
    def xy(self) -> tuple[float, float]:
        """True position in the map, metres; odometry has no error here."""
        x, y, _ = self._last.T_map_body[:3, 3]
        return float(x), float(y)

    @property
    def collided(self) -> bool:
        """Whether the navigation mesh stopped the robot during the last ``advance``."""
        return self._last.collided

    @property
    def contacts(self) -> int:
        """How often the navigation mesh stopped it above ``IMPACT_MPS``."""
        return self._robot.contacts

    @property
    def edges_crossed(self) -> int:
        """None: the navigation mesh ends where the floor does."""
        return 0

    def advance(self, command: Velocity2d, before_s: float, now_s: float) -> None:
        """Send a command at ``before_s`` and drive until ``now_s``."""
        self._sequence += 1
        linear, angular = command.linear_mps, command.angular_radps
        self._commands.put(VelocityCommand(self._sequence, stamp_of(before_s), linear, angular))
        self._robot.obey(self._robot.received(), before_s, stamp_of(before_s))
        self._robot.advance(now_s)
        self._robot.publish_odometry(stamp_of(now_s))
        self._last = _received(self._odometry)

    def odometry(self) -> F64:
        """T_map_body (4, 4) of the last message."""
        return self._last.T_map_body

    def frame(self, now_s: float) -> RgbdFrame:
        """The camera's frame at ``now_s``."""
        self._robot.publish_frame(stamp_of(now_s))
        return _received(self._frames)


def _received(subscription: Subscription[M]) -> M:
    message = subscription.take(0.0)
    if message is None:
        raise RuntimeError(f"the robot sent no valid message: {subscription.counters.last_problem}")
    return message
