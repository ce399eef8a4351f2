"""The real workers search in virtual time; the same seed gives the same run, byte for byte."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from onemap_shared import keys
from onemap_shared.messages import SearchId, SearchRequest, SearchState, SearchStatus
from onemap_shared.transport import CallError
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.parts import scene_truth
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.navigation.episode import EpisodeSetup, perception, system_config
from onemap_tools.bench.options import NavigationBench
from onemap_tools.virtual.config import SystemConfig
from onemap_tools.virtual.network import VirtualBus
from onemap_tools.virtual.scheduler import VirtualWorld
from onemap_tools.virtual.system import Equipment, VirtualSystem, simulated

APARTMENT, SOUGHT, NEAR_CELLS = 1, "television", 50


@cache
def place() -> tuple[EpisodeSetup, Scene, LabelRenderer]:
    """An apartment whose robot starts some metres before the object."""
    setup = EpisodeSetup(0, SystemConfig.read(None, seed=APARTMENT), NavigationBench())
    scene = generate_apartment(APARTMENT, STYLES[setup.config.simulator.style])
    way = scene_truth(scene, setup.config.simulator).shortest_path(SOUGHT, *scene.start[:2])
    x, y = map(float, way[max(len(way) - NEAR_CELLS, 0)])
    return setup, replace(scene, start=(x, y, 0.0)), LabelRenderer(scene)


def searched(
    folder: Path, seed: int, until_s: float, objects: tuple[str, ...] = (SOUGHT,)
) -> tuple[VirtualWorld, list[SearchStatus]]:
    """A world in which a user searches; how the search stood."""
    setup, scene, renderer = place()
    config = system_config(setup)
    folder.mkdir()
    robot = simulated(scene, config.simulator, renderer)
    equipment = Equipment(config, robot, perception(scene, setup, config), folder)
    world, told = VirtualWorld(seed, preempt=0.2), list[SearchStatus]()
    system = VirtualSystem(world, equipment)
    system.start_all()

    def search(bus: VirtualBus) -> None:
        while not told:
            bus.clock.sleep(0.5)
            try:
                told.append(bus.call(keys.SEARCH_START, SearchRequest(objects)))
            except CallError:  # not there yet
                continue
        while told[-1].active:
            bus.clock.sleep(0.5)
            told.append(bus.call(keys.SEARCH_GET, SearchId(told[0].search_id)))

    system.spawn_user(search)
    world.run(until_s, stop=lambda: bool(told) and not told[-1].active)
    world.close()
    assert world.crashes == []
    return world, told


@pytest.mark.slow
def test_the_services_find_an_object(tmp_path: Path) -> None:
    world, told = searched(tmp_path / "world", 1, 120.0)
    assert told[-1].state is SearchState.FOUND
    assert [result.name for result in told[-1].results] == [SOUGHT]
    assert world.now_s < 100.0


def test_the_same_seed_gives_the_same_run(tmp_path: Path) -> None:
    first, told = searched(tmp_path / "first", 1, 3.0)
    second, _ = searched(tmp_path / "second", 1, 3.0)
    other, _ = searched(tmp_path / "other", 2, 3.0)
    assert (first.trace, first.switches) == (second.trace, second.switches)
    assert first.trace != other.trace
    assert told[-1].active
