"""Only the arrival of something new is fresh; clocks of two boxes are never compared."""

from onemap_planner.motion.staleness import Arrival, ages, newest, stale_reason
from tests.planner.drawn_maps import PARAMS

SECOND = 1_000_000_000


def test_a_repeated_message_is_not_fresh() -> None:
    known = Arrival(7, 0, 1.0)
    assert newest(known, Arrival(7, 0, 9.0)) is known
    assert newest(known, Arrival(3, 0, 9.0)).at_s == 9.0  # the mapper was restarted
    assert newest(None, known) is known


def test_stamps_that_cannot_be_compared_are_left_alone() -> None:
    wild = ages(Arrival(1, 5 * SECOND, 1.0), Arrival(1, 900 * SECOND, 1.0), 1.0)
    assert wild.map_lag_s == 0.0
    assert stale_reason(wild, PARAMS.staleness) == ""
