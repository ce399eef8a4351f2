"""Habitat's robot in real time: rates, commands, and the process around it."""

from __future__ import annotations

import signal
import threading
from pathlib import Path
from typing import Any

import pytest

from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import VelocityCommand
from onemap_tools.bench.habitat import __main__ as process
from onemap_tools.bench.habitat.live import LiveHabitatRobot, following
from onemap_tools.bench.habitat.params import HabitatRobotParams
from onemap_tools.bench.habitat.robot import HabitatRobot
from onemap_tools.bench.habitat.world import AgentImage
from tests.tools.bench.habitat.fake_world import FakeWorld
from tests.tools.bench.habitat.files import SCENE_V1, multi_object, write

PARAMS = HabitatRobotParams(width=16, height=16)


def test_it_publishes_at_its_rates_and_follows_commands() -> None:
    router = MemoryRouter()
    bus = router.bus()
    odometry, frames = bus.subscribe(ROBOT_ODOMETRY, 100), bus.subscribe(ROBOT_RGBD, 100)
    live = LiveHabitatRobot(HabitatRobot(router.bus(), FakeWorld(), PARAMS, now_s=5.0), 5.0)
    for n in range(100):  # two seconds in steps of 20 ms
        now_s = 5.0 + n / 50
        live.step(VelocityCommand(n, 0, 0.5, 0.0), now_s, int(now_s * 1e9))
    poses = [odometry.take(0.0) for _ in range(40)]
    last = poses[-1]
    assert last is not None
    assert last.T_map_body[0, 3] == pytest.approx(0.5 * (last.stamp_ns / 1e9 - 5.0))
    assert odometry.take(0.0) is None
    assert sum(frames.take(0.0) is not None for _ in range(100)) == 16


def test_periods_missed_in_a_stall_are_skipped() -> None:
    assert following(1.0, 0.1, 1.05) == pytest.approx(1.1)
    assert following(1.0, 0.1, 7.0) == pytest.approx(7.1)


class BriefWorld(FakeWorld):
    """Stops the process after three pictures."""

    def __init__(self, stop: threading.Event) -> None:
        super().__init__()
        self._stop, self._left = stop, 3

    def capture(self) -> AgentImage:
        self._left -= 1
        if not self._left:
            self._stop.set()
        return super().capture()


@pytest.fixture
def arguments(tmp_path: Path) -> list[str]:
    file = write(tmp_path / "a.json.gz", multi_object(SCENE_V1, ["bed", "sofa"]))
    return ["--episodes", str(file), "--scenes", str(tmp_path)]


@pytest.fixture
def router(monkeypatch: pytest.MonkeyPatch) -> MemoryRouter:
    """A bus in this process, and a world that ends it, in place of Zenoh and of Habitat."""
    made, stops = MemoryRouter(), []

    def open_bus(config: Any, service: str, instance: str, stop: threading.Event) -> Any:
        assert (service, instance) == ("robot", "habitat")
        stops.append(stop)
        return made.bus(service)

    def drive(bus: Any, world: Any, episode: Any, params: Any, stop: threading.Event) -> None:
        whole(bus, BriefWorld(stop), episode, PARAMS, stop)

    whole = process.drive
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    monkeypatch.setattr(process, "HabitatWorld", lambda _: FakeWorld())
    monkeypatch.setattr(process, "open_bus", open_bus)
    monkeypatch.setattr(process, "drive", drive)
    return made


def test_the_process_is_a_robot_until_it_is_stopped(
    router: MemoryRouter, arguments: list[str]
) -> None:
    bus = router.bus()
    frames, odometry = bus.subscribe(ROBOT_RGBD, 9), bus.subscribe(ROBOT_ODOMETRY, 99)
    bus.publish(ROBOT_CMD_VEL).put(VelocityCommand(1, 0, 0.5, 0.0))
    assert process.main(arguments) == 0
    assert [frames.take(0.0) is not None for _ in range(4)] == [True, True, True, False]
    first = odometry.take(0.0)
    assert first is not None
    assert first.T_map_body[:3, 3].tolist() == [2.0, -1.0, 0.0]  # the episode's start


def test_stopped_before_there_is_a_router_it_ends_well(
    router: MemoryRouter, arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(process, "open_bus", lambda *_: None)
    assert process.main(arguments) == 0


def test_what_is_missing_is_said_in_a_sentence(
    router: MemoryRouter, arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert process.main([*arguments, "--episode", "1"]) == 2
    assert "holds 1 episodes: there is no number 1" in capsys.readouterr().err
    assert process.main([*arguments, "--config", "absent.yaml"]) == 2
    assert "habitat: cannot read configuration absent.yaml" in capsys.readouterr().err
