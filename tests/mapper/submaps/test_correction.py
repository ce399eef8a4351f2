"""Corrections of a pose graph, between, before and after its keyframes."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.belief.submaps import NO_CORRECTION, PlanarCorrection, correction_at
from onemap_shared.geometry import F64, pose_2d, transform
from onemap_shared.messages import PoseGraph

POINTS = np.array([[0.0, 0.0], [1.5, -2.0], [-3.0, 4.0]])
SECOND = 10**9
START = 1_700_000_000 * SECOND


def graph(*corrected: F64) -> PoseGraph:
    """Keyframes a second and a metre apart, with these poses now."""
    published = [pose_2d(float(k), 0.0, 0.3 * k) for k in range(len(corrected))]
    stamps = START + SECOND * np.arange(len(corrected))
    last = int(stamps[-1]) + SECOND
    return PoseGraph(1, last, stamps, np.stack(published), np.stack(corrected))


def test_undoing_a_correction_gives_the_points_back() -> None:
    correction = PlanarCorrection.about(POINTS[1], to_m=np.array([2.0, 0.5]), yaw_rad=0.7)
    np.testing.assert_allclose(correction.apply(POINTS[1:2]), [[2.0, 0.5]], atol=1e-12)
    np.testing.assert_allclose(correction.undo(correction.apply(POINTS)), POINTS, atol=1e-12)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_keyframes_surroundings_move_with_it(index: int) -> None:
    message = graph(
        pose_2d(0.1, 0.2, 0.05), pose_2d(1.3, 0.1, 0.4), pose_2d(1.9, -0.4, 0.5)
    )  # fmt: skip
    seen_from = np.array([*np.random.default_rng(0).normal(size=2), 0.0])
    place = transform(message.T_map_body_published[index], seen_from)
    stamp_ns = int(message.keyframe_stamps_ns[index])
    centre_m = message.T_map_body_published[index][:2, 3]
    moved = correction_at(message, stamp_ns, centre_m).apply(place[None, :2])[0]
    np.testing.assert_allclose(moved, transform(message.T_map_body[index], seen_from)[:2])


def test_between_keyframes_the_correction_changes_evenly() -> None:
    message = graph(pose_2d(0.0, 0.0, 0.0), pose_2d(1.0, 0.4, 0.5))
    centre_m = np.array([0.5, 0.0])
    half = correction_at(message, START + SECOND // 2, centre_m)
    first = correction_at(message, START, centre_m)
    second = correction_at(message, START + SECOND, centre_m)
    assert half.yaw_rad == pytest.approx(0.1)
    middle = (first.apply(centre_m[None]) + second.apply(centre_m[None])) / 2
    np.testing.assert_allclose(half.apply(centre_m[None]), middle)


def test_the_ends_hold_outside_and_later_poses_are_right() -> None:
    message = graph(pose_2d(0.2, 0.0, 0.0), pose_2d(1.0, 0.4, 0.3))
    centre_m = np.zeros(2)
    earlier = correction_at(message, START - 5 * SECOND, centre_m)
    assert earlier == correction_at(message, START, centre_m)
    assert earlier.x_m == pytest.approx(0.2)
    assert correction_at(message, message.stamp_ns, centre_m).y_m == pytest.approx(0.4)
    assert correction_at(message, message.stamp_ns + 1, centre_m) is NO_CORRECTION
