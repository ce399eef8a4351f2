"""Simulation of one robot over time. Time is an argument: seconds of any monotonic clock."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from onemap_shared.command_gate import Deadman
from onemap_shared.geometry import Velocity2d
from onemap_simulator.physics.collision import CollisionMap, MissingFloor
from onemap_simulator.physics.people import NOBODY, Bystanders, People
from onemap_simulator.physics.robot import RobotParams, RobotState, step

MAX_STEP_S = 0.02  # at 0.7 m/s 14 mm, small against furniture
IMPACT_MPS = 0.05  # below this speed, contact is not counted as a new collision
MAX_PAUSE_S = 1.0  # simulated at most after a pause, such as a suspended computer
LAG_S = 0.3  # between two steps: as long as a command holds, so that the robot brakes by itself
LAG_TOLD_S = 5.0  # for which a lag is told


@dataclass(slots=True)
class SimulationCounts:
    """Since the start: collisions, commands received, stops by the deadman timer.

    ``edges_crossed``: how often the robot's disc came over a place without floor;
    ``people_touched``: those of the collisions that were with people.
    """

    collisions: int = 0
    commands_received: int = 0
    deadman_stops: int = 0
    edges_crossed: int = 0
    people_touched: int = 0


class Simulation:
    """One robot in a collision map. It does not fall where floor is missing: that is counted."""

    def __init__(
        self,
        collision: CollisionMap,
        params: RobotParams,
        start: RobotState,
        *,
        now_s: float,
        missing_floor: MissingFloor | None = None,
        people: People | None = None,
    ) -> None:
        self._collision = collision
        self._people = people
        self._missing_floor = missing_floor
        self._parameters = params
        self._deadman = Deadman()
        self._now_s = now_s
        self._lag_s, self._lagged_at_s = 0.0, float("-inf")
        self.state = start
        self.counts = SimulationCounts()
        self._over_edge = self._is_over_edge()
        if self._collides(start.x_m, start.y_m):
            raise ValueError(
                f"the robot's start ({start.x_m:.2f}, {start.y_m:.2f}) is "
                f"{collision.clearance_m(start.x_m, start.y_m):.2f} m from an obstacle; "
                f"its radius is {params.radius_m} m"
            )

    def receive_command(self, command: Velocity2d, now_s: float, validity_s: float) -> None:
        """Follow a command from ``now_s`` on, for at most ``validity_s``."""
        self._deadman = self._deadman.with_command(command, now_s, validity_s)
        self.counts.commands_received += 1

    def advance(self, now_s: float) -> bool:
        """Simulate up to ``now_s``; returns whether an obstacle stopped the robot on the way."""
        collided = False
        lag_s = now_s - self._now_s
        if lag_s > LAG_S and self.counts.commands_received:  # before that, nobody drives
            self._lag_s, self._lagged_at_s = lag_s, now_s
        self._now_s = max(self._now_s, now_s - MAX_PAUSE_S)
        while self._now_s < now_s:
            # The epsilon avoids a last step of zero length by rounding.
            dt_s = MAX_STEP_S if now_s - self._now_s > MAX_STEP_S + 1e-6 else now_s - self._now_s
            before = self.state
            if self._people is not None:
                self._people.advance(dt_s, (before.x_m, before.y_m))
            self.state = step(
                before,
                self._deadman.command_at(self._now_s),
                dt_s,
                params=self._parameters,
                collides=self._collides,
            )
            if self._deadman.expired_between(self._now_s, self._now_s + dt_s):
                self.counts.deadman_stops += 1
            if self.state.collided and before.velocity.speed_mps > IMPACT_MPS:
                self.counts.collisions += 1
                self.counts.people_touched += self._touched_person(before, dt_s)
            was_over_edge, self._over_edge = self._over_edge, self._is_over_edge()
            if self._over_edge and not was_over_edge:
                self.counts.edges_crossed += 1
            collided = collided or self.state.collided
            self._now_s += dt_s
        return collided

    def lag_problem(self, now_s: float) -> str:
        """That the simulation lately stood still, in a sentence; empty if it did not."""
        if now_s - self._lagged_at_s > LAG_TOLD_S:
            return ""
        return (
            f"the simulator stood still for {self._lag_s:.1f} s: this machine is too busy for it, "
            "and the robot waits or moves with a jerk"
        )

    @property
    def bystanders(self) -> Bystanders:
        """Where people are now."""
        return NOBODY if self._people is None else self._people.bystanders

    def _collides(self, x_m: float, y_m: float) -> bool:
        radius_m = self._parameters.radius_m
        if self._people is not None and self._people.distance_m(x_m, y_m) < radius_m:
            return True
        return self._collision.clearance_m(x_m, y_m) < radius_m

    def _touched_person(self, before: RobotState, dt_s: float) -> bool:
        """Whether a person, and not furniture, stopped the robot in its last step."""
        params = self._parameters
        reach_m = params.radius_m + hypot(params.max_linear_mps, params.max_lateral_mps) * dt_s
        return self._people is not None and (
            self._people.distance_m(before.x_m, before.y_m) <= reach_m
        )

    def _is_over_edge(self) -> bool:
        state, floor = self.state, self._missing_floor
        return floor is not None and floor.touches(state.x_m, state.y_m, self._parameters.radius_m)
