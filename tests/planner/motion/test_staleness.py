"""Only the arrival of something new is fresh; clocks of two boxes are never compared."""

from math import inf

from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.motion.staleness import (
    Arrival,
    InputAges,
    ages,
    map_age_limit_s,
    newest,
    stale_reason,
)
from tests.planner.drawn_maps import PARAMS

SECOND = 1_000_000_000
LIMITS = PARAMS.staleness
AT_THE_LIMIT = InputAges(LIMITS.max_odometry_age_s, LIMITS.min_map_age_s, 1.0, inf, 1.5)
seconds = st.one_of(
    st.floats(0, 3),
    st.sampled_from([inf, *(getattr(AT_THE_LIMIT, n) for n in InputAges.__slots__)]),
)


@given(seconds, seconds, seconds, seconds)
def test_every_age_above_its_limit_stops_the_robot(
    odometry_s: float, map_s: float, map_lag_s: float, view_lag_s: float
) -> None:
    lag_s = LIMITS.map_lag_factor * LIMITS.min_map_age_s
    exceeded = (
        odometry_s > LIMITS.max_odometry_age_s
        or map_s > LIMITS.min_map_age_s
        or map_lag_s > lag_s
        or view_lag_s > lag_s + LIMITS.max_view_lag_s
    )
    age = InputAges(odometry_s, map_s, map_lag_s, inf, view_lag_s)
    assert bool(stale_reason(age, LIMITS)) == exceeded


def test_ages_at_their_limits_are_fresh() -> None:
    assert stale_reason(AT_THE_LIMIT, LIMITS) == ""


def test_a_repeated_message_is_not_fresh() -> None:
    known = Arrival(7, 0, 1.0)
    assert newest(known, Arrival(7, 0, 9.0)) is known
    assert newest(known, Arrival(3, 0, 9.0)).at_s == 9.0  # the mapper was restarted
    assert newest(None, known) is known


@given(lag_s=st.floats(-1e4, 1e4), period_s=st.floats(0.05, 9.0))
def test_no_lag_of_the_map_is_too_large_to_count(lag_s: float, period_s: float) -> None:
    odometry = Arrival(1, 10**6 * SECOND, 5.0)
    shown = Arrival(1, odometry.stamp_ns - round(lag_s * SECOND), 5.0)
    age = ages(odometry, shown, 5.0, period_s)
    longest_s = LIMITS.map_lag_factor * LIMITS.max_map_age_s
    if not -LIMITS.max_map_ahead_s - 1e-6 <= lag_s <= longest_s + 1e-6:
        assert stale_reason(age, LIMITS)


def test_a_map_without_a_frame_of_this_robot_is_no_late_one() -> None:
    empty = ages(Arrival(1, 10**6 * SECOND, 5.0), Arrival(0, 0, 5.0), 5.0)
    assert stale_reason(empty, LIMITS) == "waiting for the map: it has no image of this robot yet"


def test_a_clock_that_was_set_is_told() -> None:
    def reason(odometry_s: int) -> str:
        odometry = Arrival(1, odometry_s * SECOND, 1.0)
        return stale_reason(ages(odometry, Arrival(1, 900 * SECOND, 1.0), 1.0), LIMITS)

    assert reason(905) == "waiting for the camera: 5.0 s behind"
    assert reason(930) == "waiting for the camera: 30.0 s behind, or the robot's clock was set"
    assert reason(880) == (
        "waiting for the camera: its stamps are 20.0 s ahead of the robot's position: "
        "was a clock set?"
    )


@given(st.one_of(st.just(inf), st.floats(0.01, 100)))
def test_the_age_that_stops_the_robot_follows_the_map_s_period_within_limits(
    period_s: float,
) -> None:
    limit_s = map_age_limit_s(period_s, LIMITS)
    assert LIMITS.min_map_age_s <= limit_s <= LIMITS.max_map_age_s
    between = LIMITS.min_map_age_s < limit_s < LIMITS.max_map_age_s
    assert not between or limit_s == LIMITS.map_periods * period_s


def test_a_map_of_two_frames_per_second_does_not_stop_the_robot() -> None:
    slow = InputAges(0.1, 0.9, 1.3, map_period_s=0.5)
    assert stale_reason(slow, LIMITS) == ""
    assert stale_reason(InputAges(0.1, 0.9, 1.3), LIMITS) == "waiting for the map: none for 0.9 s"
    assert stale_reason(InputAges(0.1, 1.1, 1.3, map_period_s=0.5), LIMITS)
    assert stale_reason(InputAges(0.1, 1.6, 1.6, map_period_s=9.0), LIMITS)
    assert slow.map_content_s == 1.3
    assert InputAges(0.1, 0.2, 0.0).map_content_s == 0.2
