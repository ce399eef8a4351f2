"""Stages that compute for some time, and a link that is slow, in virtual time."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared.messages import SearchRequest
from onemap_shared.wire import Packet, decode
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.navigation.benchmark import described, setups
from onemap_tools.bench.navigation.episode import link_of, perception, system_config
from onemap_tools.bench.navigation.search import WatchedSearch
from onemap_tools.bench.options import NavigationBench
from onemap_tools.virtual.latency import Latencies
from onemap_tools.virtual.scheduler import EPOCH_NS
from onemap_tools.virtual.system import Equipment, simulated

OPTIONS = NavigationBench(seed=2, episodes=1)
STREAMS = (keys.FIELD, keys.DETECTIONS, keys.MAP_REVISION, keys.SEARCH_PATH)


@cache
def apartment() -> tuple[Scene, LabelRenderer]:
    scene = generate_apartment(2)
    return scene, LabelRenderer(scene)


Ages = dict[str, list[float]]


def searched(folder: Path, seconds: float = 2.0, **changes: Any) -> tuple[int, Ages]:
    """The trace of a search, and how long after each frame's capture, in milliseconds, the
    messages came that the newest frame by then had led to; of commands, when they came."""
    latencies = changes.pop("latencies", Latencies())
    options = replace(OPTIONS, **changes)
    setup = setups(options)[0]
    scene, renderer = apartment()
    config = system_config(setup)
    folder.mkdir()
    equipment = Equipment(
        config,
        simulated(scene, config.simulator, renderer),
        perception(scene, setup, config),
        folder,
        latencies=latencies,
        link=link_of(options),
    )
    ages: Ages = {topic.key: [] for topic in (*STREAMS, keys.ROBOT_CMD_VEL)}
    shown_ns = 0
    with closing(WatchedSearch(equipment, 2)) as search:

        def hear(key: str, packet: Packet) -> None:
            nonlocal shown_ns
            if key == keys.ROBOT_CMD_VEL.key:
                ages[key].append(search.world.now_ns * 1e-6)
            for topic in STREAMS:
                if key != topic.key:
                    continue
                stamp_ns = decode(topic.message, packet).stamp_ns
                if topic is keys.SEARCH_PATH:
                    stamp_ns = shown_ns
                if topic is keys.MAP_REVISION:
                    shown_ns = stamp_ns
                if stamp_ns:
                    ages[key].append((EPOCH_NS + search.world.now_ns - stamp_ns) * 1e-6)

        search.system.router.observers.append(hear)
        search.run(SearchRequest(("sofa",)), seconds)
        return search.world.trace, ages


def test_without_latencies_what_a_frame_leads_to_comes_at_once_and_commands_each_period(
    tmp_path: Path,
) -> None:
    """Commands also after a new plan."""
    _, ages = searched(tmp_path / "search")
    for topic in STREAMS:
        assert max(ages[topic.key]) < 1.0, topic.key
    times = ages[keys.ROBOT_CMD_VEL.key]
    assert len(times) > 40
    assert max(np.diff(times)) < 51.0


def test_each_stage_comes_as_late_as_it_computes(tmp_path: Path) -> None:
    times = Latencies(encode_ms=(30.0,), detect_ms=(70.0,), update_ms=(20.0,), plan_ms=(40.0,))
    _, ages = searched(tmp_path / "search", latencies=times)
    expected = {keys.FIELD.key: 30.0, keys.DETECTIONS.key: 70.0, keys.MAP_REVISION.key: 50.0}
    for key, age_ms in expected.items():
        assert ages[key][-1] == pytest.approx(age_ms, abs=1.0), key
    assert ages[keys.SEARCH_PATH.key][-1] == pytest.approx(90.0, abs=1.0)


def test_a_link_delays_by_its_rate_and_way_and_the_same_seed_gives_the_same_run(
    tmp_path: Path,
) -> None:
    """A frame has 96 kB, a field 270 kB."""
    changes: dict[str, Any] = {"link": 20.0, "delay": 10.0, "jitter": 5.0}
    first, ages = searched(tmp_path / "first", **changes)
    again, _ = searched(tmp_path / "again", **changes)
    other, _ = searched(tmp_path / "other", link=20.0, delay=10.0)
    assert first == again != other
    fields, revisions = ages[keys.FIELD.key], ages[keys.MAP_REVISION.key]
    assert 160.0 < min(revisions) <= max(revisions) < 190.0
    assert fields == pytest.approx(revisions, abs=1.0)  # both are told at the router


def test_on_a_link_that_is_too_slow_frames_are_left_out_and_none_waits(tmp_path: Path) -> None:
    _, ages = searched(tmp_path / "search", 8.0, link=4.0)
    fields = ages[keys.FIELD.key]
    assert 10 < len(fields) < 18
    assert max(fields) < 2500.0  # two frames and two fields under way


def test_times_are_read_of_a_table_or_of_a_result(tmp_path: Path) -> None:
    file = tmp_path / "times.json"
    file.write_text(json.dumps({"benchmark": "system", "latency": {"encode_ms": [90, 100, 150]}}))
    setup = setups(replace(OPTIONS, latency=file))[0]
    assert setup.latencies == Latencies(encode_ms=(90.0, 100.0, 150.0))
    assert described(replace(OPTIONS, latency=file))["latency"]["encode_ms"] == [90.0, 100.0, 150.0]
    file.write_text('{"encode": 3}')
    with pytest.raises(ValueError, match=r"times\.json holds no latencies: write it by 'onemap"):
        setups(replace(OPTIONS, latency=file))
