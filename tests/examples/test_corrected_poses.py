"""The example for a SLAM: the mapper moves what was seen from a corrected keyframe."""

from __future__ import annotations

from pathlib import Path

import pytest

from examples.corrected_poses import CorrectedPoses
from onemap_mapper.config import MapperConfig
from onemap_mapper.service import Mapper
from onemap_shared import keys
from onemap_shared.geometry import pose_2d
from tests.mapper import scenes
from tests.memory_bus import MemoryRouter


def test_the_map_follows_the_example(tmp_path: Path) -> None:
    router = MemoryRouter()
    mapper = Mapper((router.bus("mapper"),), MapperConfig(map_folder=tmp_path))
    robot = router.bus("robot")
    fields = robot.publish(keys.FIELD)
    poses = CorrectedPoses(robot)
    mapper.step(0.0)
    for sequence in range(3):
        field = scenes.field(sequence, scenes.pose(0.1 * sequence))
        fields.put(field)
        poses.published(field.stamp_ns, field.T_map_camera)
        mapper.step(0.0)
    before = mapper._map.store.cells.mean(axis=0)
    keyframe = scenes.field(1, scenes.pose(0.1))
    poses.corrected(
        {
            keyframe.stamp_ns: pose_2d(1.0, 0.5, 0.0) @ keyframe.T_map_camera,
            77: keyframe.T_map_camera,
        }
    )
    mapper.step(0.0)
    assert mapper._map.store.cells.mean(axis=0) - before == pytest.approx((10, 5))


def test_what_it_remembers_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("examples.corrected_poses.MAX_FRAMES", 20)
    poses, here = CorrectedPoses(MemoryRouter().bus("robot")), pose_2d(0.0, 0.0, 0.0)
    keyframes = {}
    for stamp in range(1, 1000):
        poses.published(stamp, here)
        if stamp % 10 == 0:
            keyframes[stamp] = here
            poses.corrected(keyframes)
    assert poses._published.keys() == {*keyframes, *range(991, 1000)}
    for stamp in range(1000, 2000):
        poses.published(stamp, here)
    assert len(poses._published) == len(keyframes) + 20
