from __future__ import annotations

from onemap_shared.trail import extended


def test_a_trail_grows_by_steps_that_are_long_enough() -> None:
    trail = extended((), (0.0, 0.0), step_m=0.1)
    assert extended(trail, (0.05, 0.0), step_m=0.1) == ((0.0, 0.0),)
    assert extended(trail, (0.06, 0.08), step_m=0.1) == ((0.0, 0.0), (0.06, 0.08))


def test_the_oldest_points_go_first() -> None:
    trail: tuple[tuple[float, float], ...] = ()
    for x in range(5):
        trail = extended(trail, (float(x), 0.0), step_m=0.5, max_points=3)
    assert trail == ((2.0, 0.0), (3.0, 0.0), (4.0, 0.0))


def test_a_jump_starts_a_new_trail() -> None:
    trail = ((0.0, 0.0), (0.5, 0.0))
    assert extended(trail, (9.0, 0.0), step_m=0.1, jump_m=1.0) == ((9.0, 0.0),)
    assert len(extended(trail, (9.0, 0.0), step_m=0.1)) == 3
