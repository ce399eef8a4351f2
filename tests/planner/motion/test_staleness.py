"""Only the arrival of something new is fresh; clocks of two boxes are never compared."""

from math import inf

from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.motion.staleness import Arrival, InputAges, ages, newest, stale_reason
from tests.planner.drawn_maps import PARAMS

SECOND = 1_000_000_000
LIMITS = PARAMS.staleness
AT_THE_LIMIT = InputAges(LIMITS.max_odometry_age_s, LIMITS.max_map_age_s, LIMITS.max_map_lag_s)
seconds = st.one_of(
    st.floats(0, 3),
    st.sampled_from([inf, *(getattr(AT_THE_LIMIT, n) for n in InputAges.__slots__)]),
)


@given(seconds, seconds, seconds)
def test_every_age_above_its_limit_stops_the_robot(
    odometry_s: float, map_s: float, map_lag_s: float
) -> None:
    exceeded = (
        odometry_s > LIMITS.max_odometry_age_s
        or map_s > LIMITS.max_map_age_s
        or map_lag_s > LIMITS.max_map_lag_s
    )
    assert bool(stale_reason(InputAges(odometry_s, map_s, map_lag_s), LIMITS)) == exceeded


def test_ages_at_their_limits_are_fresh() -> None:
    assert stale_reason(AT_THE_LIMIT, LIMITS) == ""


def test_a_repeated_message_is_not_fresh() -> None:
    known = Arrival(7, 0, 1.0)
    assert newest(known, Arrival(7, 0, 9.0)) is known
    assert newest(known, Arrival(3, 0, 9.0)).at_s == 9.0  # the mapper was restarted
    assert newest(None, known) is known


def test_stamps_that_cannot_be_compared_are_left_alone() -> None:
    wild = ages(Arrival(1, 5 * SECOND, 1.0), Arrival(1, 900 * SECOND, 1.0), 1.0)
    assert wild.map_lag_s == 0.0
    assert stale_reason(wild, LIMITS) == ""
