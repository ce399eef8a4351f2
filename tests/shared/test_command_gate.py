"""A robot follows one planner, its newest command, and none that was made on old odometry."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from onemap_shared.command_gate import MAX_COMMAND_AGE_S, RELEASE_S, CommandGate
from onemap_shared.messages import VelocityCommand

SECOND = 1_000_000_000
CLOCK_NS = 1_700_000_000 * SECOND  # the robot's, at monotonic time 0


def command(
    sequence: int, planner: str = "a", *, age_s: float = 0.1, linear: float = 0.5
) -> VelocityCommand:
    """A command that arrives at time 10 s, made on odometry of this age."""
    made_ns = int(CLOCK_NS + (10.0 - age_s) * SECOND)
    return VelocityCommand(sequence, 5, linear, 0.2, planner=planner, odometry_stamp_ns=made_ns)


def received(
    gate: CommandGate, given: VelocityCommand, now_s: float = 10.0
) -> tuple[CommandGate, VelocityCommand | None]:
    return gate.receive(given, now_s, int(CLOCK_NS + now_s * SECOND))


def test_it_says_which_planner_it_follows_and_its_newest_command() -> None:
    gate = CommandGate()
    assert gate.echo(10.0) == ("", 0)
    gate, allowed = received(gate, command(7))
    assert allowed == command(7)
    assert gate.echo(10.0 + RELEASE_S) == ("a", 7)
    assert gate.echo(10.1 + RELEASE_S) == ("", 0)


def test_of_two_planners_it_follows_the_first_until_that_is_silent() -> None:
    gate, _ = received(CommandGate(), command(1, "a"))
    for k in range(40):  # both send 20 commands a second, with opposite signs
        now_s = 10.0 + k / 20
        gate, first = received(gate, command(k + 2, "a", age_s=0.1 - k / 20), now_s)
        gate, second = received(gate, command(k + 1, "b", linear=-0.5), now_s)
        assert first is not None
        assert second is None
    assert gate.foreign == 40
    gate, allowed = received(gate, command(90, "b", age_s=-3.0), 13.0)
    assert allowed is not None
    assert gate.echo(13.0) == ("b", 90)


def test_a_command_that_was_overtaken_counts_for_nothing() -> None:
    gate, _ = received(CommandGate(), command(7))
    for late in (7, 6, -3):
        gate, allowed = received(gate, command(late))
        assert allowed is None
    assert (gate.disordered, gate.sequence) == (3, 7)
    gate, allowed = received(gate, command(1), 11.1)  # it was silent: it counts anew
    assert allowed is not None


@given(age_s=st.floats(-5.0, 60.0), linear=st.sampled_from([0.5, -0.1]))
def test_a_command_made_on_old_odometry_brakes(age_s: float, linear: float) -> None:
    gate, allowed = received(CommandGate(), command(3, age_s=age_s, linear=linear))
    assert allowed is not None
    old = not 0.0 <= age_s <= MAX_COMMAND_AGE_S
    if min(abs(age_s - MAX_COMMAND_AGE_S), abs(age_s)) > 1e-6:
        assert allowed.moves != old
        assert gate.late == old
    assert gate.echo(10.0) == ("a", 3)  # so that the planner can measure its loop


def test_a_robot_that_has_braked_by_itself_obeys_what_was_made_since_only() -> None:
    gate, _ = received(CommandGate(), command(1))  # runs out at 10.3 s
    gate, held_back = received(gate, command(2, age_s=-0.25), 10.4)  # made on odometry of 10.25 s
    assert held_back is not None
    assert not held_back.moves
    assert gate.late == 1
    braked, _ = received(CommandGate(), command(1))
    _, later = received(braked, command(2, age_s=-0.35), 10.4)
    assert later is not None
    assert later.moves
