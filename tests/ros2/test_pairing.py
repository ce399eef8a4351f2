from __future__ import annotations

from onemap_ros2.robot_input import KEPT, ImagePair, PairBuffer


def test_pairs_the_nearest_within_the_tolerance() -> None:
    pairs = PairBuffer(10)
    pairs.add_depth(100, b"depth")
    pairs.add_color(85, b"far")
    assert pairs.take() is None
    pairs.add_color(108, b"near")
    pairs.add_color(109, b"next")
    assert pairs.take() == ImagePair(100, b"near", b"depth")
    assert pairs.take() is None


def test_the_newest_pair_counts_and_older_ones_are_dropped() -> None:
    pairs = PairBuffer(0)
    for stamp in (1, 2, 3):
        pairs.add_color(stamp, b"c%d" % stamp)
        pairs.add_depth(stamp, b"d%d" % stamp)
    pairs.add_depth(4, b"d4")
    assert pairs.take() == ImagePair(3, b"c3", b"d3")
    assert pairs.unpaired == 4
    pairs.add_color(4, b"c4")
    assert pairs.take() == ImagePair(4, b"c4", b"d4")


def test_what_never_finds_a_counterpart_is_bounded_and_counted() -> None:
    pairs = PairBuffer(0)
    for stamp in range(KEPT + 3):
        pairs.add_color(stamp, b"")
    assert pairs.unpaired == 3
    pairs.clear()
    pairs.add_depth(KEPT + 2, b"")
    assert pairs.take() is None
