"""A robot in Habitat for the services, in real time, until Ctrl-C.

    python -m onemap_tools.bench.habitat --episodes PATH --scenes DIR --episode N

It stands at the start of an episode, in place of the simulator or of a real robot. Runs in
Habitat's own environment, and needs of OneMap only what a plain ``pip install .`` brings.
"""

from __future__ import annotations

import argparse
import logging
import signal
import sys
import threading
import time
from pathlib import Path

from onemap_shared.bus import open_bus
from onemap_shared.config import BusConfig, ConfigError, read, section
from onemap_shared.transport import Bus
from onemap_tools.bench.habitat.episode_files import read_episode
from onemap_tools.bench.habitat.episode_layout import HabitatEpisode
from onemap_tools.bench.habitat.habitat_world import HabitatWorld
from onemap_tools.bench.habitat.live import PERIOD_S, LiveHabitatRobot
from onemap_tools.bench.habitat.params import HabitatRobotParams
from onemap_tools.bench.habitat.robot import HabitatRobot
from onemap_tools.bench.habitat.world import World

LOG = logging.getLogger("onemap.habitat")
EXIT_OK, EXIT_MISUSED = 0, 2


def main(arguments: list[str] | None = None) -> int:
    """Read the episode, open its scene, join the bus and drive; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m onemap_tools.bench.habitat")
    parser.add_argument("--episodes", type=Path, required=True, help="as onemap bench habitat")
    parser.add_argument("--scenes", type=Path, required=True, help="as onemap bench habitat")
    parser.add_argument("--episode", type=int, default=0, help="number, from 0 in file order")
    parser.add_argument("--config", type=Path, help="YAML file with the router's address")
    options = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s habitat: %(message)s")
    stop = threading.Event()
    for signum in (signal.SIGINT, signal.SIGTERM):
        signal.signal(signum, lambda *_: stop.set())
    params = HabitatRobotParams()
    try:
        bus_config = section(read(options.config), "bus", BusConfig)
        episode = read_episode(options.episodes, options.episode)
        world = HabitatWorld(params)
        world.open(options.scenes / episode.scene, options.scenes / episode.scene_config)
    except (ConfigError, ValueError) as problem:
        print(f"habitat: {problem}", file=sys.stderr)
        return EXIT_MISUSED
    bus = open_bus(bus_config, "robot", "habitat", stop)
    try:
        if bus is not None:
            drive(bus, world, episode, params, stop)
    finally:
        world.close()
        if bus is not None:
            bus.close()
    return EXIT_OK


def drive(
    bus: Bus,
    world: World,
    episode: HabitatEpisode,
    params: HabitatRobotParams,
    stop: threading.Event,
) -> None:
    """Be the robot of an episode in an open scene until ``stop`` is set."""
    world.place(episode.start, episode.rotation)
    robot = HabitatRobot(bus, world, params, now_s=time.monotonic())
    live = LiveHabitatRobot(robot, time.monotonic())
    LOG.info("at the start of episode %d; it seeks %s", episode.index, ", ".join(episode.objects))
    while not stop.is_set():
        command = robot.received(PERIOD_S)
        live.step(command, time.monotonic(), time.time_ns())


if __name__ == "__main__":
    raise SystemExit(main())
