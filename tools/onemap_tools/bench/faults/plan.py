"""What happens in a run: faults and what a user does, drawn by the seed, and made fewer."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, get_args

from onemap_shared.keys import (
    DETECTIONS,
    FIELD,
    MAP_REVISION,
    ROBOT_CMD_VEL,
    ROBOT_ODOMETRY,
    ROBOT_RGBD,
    SEARCH_STATE,
)

Kind = Literal[
    "kill", "stall", "suspend", "cut", "late", "slow", "lossy", "router", "clock", "second",
    "restart", "power", "disk slow", "disk full", "disk torn",
    "doubled", "silent", "disordered", "frozen", "damaged", "garbled", "not finite",
    "jumping", "lying", "queued",
    "cancel", "drive", "zone", "name", "save", "load", "merge", "clear", "ask",
]  # fmt: skip
Act = Literal["cancel", "drive", "zone", "name", "save", "load", "merge", "clear", "ask"]
ACTS: tuple[Act, ...] = get_args(Act)  # what a user does, over HTTP
SERVICES = ("simulator", "perception", "mapper", "planner", "gateway")
OTHER_ROBOT = "ros2"  # a second one that has another name than the simulator
DISKS = ("mapper", "planner")  # whose computers have one
# How often each is drawn: what a link or a process does is where most was found.
WEIGHTS: dict[Kind, int] = {
    "kill": 4, "stall": 4, "suspend": 1, "cut": 3, "late": 3, "slow": 2, "lossy": 2,
    "router": 2, "clock": 3, "second": 1, "restart": 2, "power": 4,
    "disk slow": 2, "disk full": 1, "disk torn": 3,
    "doubled": 1, "silent": 1, "disordered": 1, "frozen": 1, "damaged": 1, "garbled": 2,
    "not finite": 1, "jumping": 1, "lying": 1, "queued": 1,
    "cancel": 4, "drive": 1, "zone": 8, "name": 1, "save": 2, "load": 1, "merge": 1, "clear": 1,
    "ask": 1,
}  # fmt: skip
STREAMS = (  # whose messages are doubled, held back, disordered or frozen
    ROBOT_RGBD.key, ROBOT_ODOMETRY.key, ROBOT_CMD_VEL.key, FIELD.key, DETECTIONS.key,
    MAP_REVISION.key, SEARCH_STATE.key,
)  # fmt: skip
CHECKED = (ROBOT_RGBD.key, FIELD.key, DETECTIONS.key)  # and damaged: no wrong velocity can be seen
BEGIN_S, LAST_S = 3.0, 12.0  # between which something happens
LONGEST_S = 8.0
ASKS_UNTIL_S = (6.0, 16.0)  # a user searches again and again until some time of these
RECOVERS_S = 6.0  # after an incident, in which what it touched may still be late
AMID = 0.7  # how probably a user acts while another incident lasts
LEAST, MOST = 2, 5  # incidents of a run
APARTMENTS = 6  # making one takes as long as 5 s of a search
FILES = ("places.bin", "objects.bin", "world.txt", "*.npz")  # that are torn, all of the name
LATE_S, SLOW_BYTES_PER_S, LOSS = (0.05, 2.0), (20_000.0, 500_000.0), (0.05, 0.4)
CLOCK_S = (0.05, 3600.0)
DISK_SLOWER = (10.0, 2000.0)


@dataclass(frozen=True, slots=True)
class Incident:
    """Something that happens to ``target`` at ``at_s`` and ends after ``lasts_s``.

    amount: seconds of delay, or that a clock jumps, bytes per second, share that is lost or that
    is left of a file, times that a disk is slower.
    """

    kind: Kind
    at_s: float
    target: str = ""
    lasts_s: float = 0.0
    amount: float = 0.0


@dataclass(frozen=True, slots=True)
class FaultPlan:
    """A run, whole: the order of threads, the apartment, what happens; until when a user asks."""

    seed: int
    apartment: int
    incidents: tuple[Incident, ...]
    asks_until_s: float = ASKS_UNTIL_S[1]

    def disturbs(self, targets: tuple[str, ...], from_s: float, until_s: float) -> bool:
        """Whether what passes these services and streams, and the router, may be late then."""
        return any(
            each.target in (*targets, "all", "")
            and each.kind not in (*ACTS, "clock", "disk slow", "disk full", "disk torn")
            and each.at_s <= until_s
            and from_s <= each.at_s + each.lasts_s + RECOVERS_S
            for each in self.incidents
        )

    @property
    def delays_commands(self) -> bool:
        """Whether commands may be late when the robot gets them."""
        on_the_way = "simulator", "planner", ROBOT_CMD_VEL.key
        kinds = "late", "slow", "lossy", "queued", "disordered"
        return any(each.kind in kinds and each.target in on_the_way for each in self.incidents)

    def smaller(self) -> Iterator[FaultPlan]:
        """Plans in which less happens, the smallest first."""
        for index, incident in enumerate(self.incidents):
            others = self.incidents[:index], self.incidents[index + 1 :]
            yield replace(self, incidents=(*others[0], *others[1]))
            if incident.lasts_s > 1.0:
                shorter = replace(incident, lasts_s=round(incident.lasts_s / 2, 1))
                yield replace(self, incidents=(*others[0], shorter, *others[1]))


def drawn(seed: int) -> FaultPlan:
    """The plan of a seed."""
    rng = random.Random(seed)
    kinds = rng.choices(list(WEIGHTS), list(WEIGHTS.values()), k=rng.randint(LEAST, MOST))
    happens = [_drawn(kind, rng) for kind in kinds]
    lasting = [each for each in happens if each.kind not in ACTS]
    for index, each in enumerate(happens):
        if each.kind in ACTS and lasting and rng.random() < AMID:
            other = rng.choice(lasting)
            at_s = round(other.at_s + rng.random() * other.lasts_s, 1)
            happens[index] = replace(each, at_s=at_s)
    incidents = sorted(happens, key=lambda each: each.at_s)
    asks_until_s = round(rng.uniform(*ASKS_UNTIL_S), 1)
    return FaultPlan(seed, 1 + rng.randrange(APARTMENTS), tuple(incidents), asks_until_s)


def _drawn(kind: Kind, rng: random.Random) -> Incident:
    at_s, lasts_s = round(rng.uniform(BEGIN_S, LAST_S), 1), round(rng.uniform(0.2, LONGEST_S), 1)
    target = rng.choice(SERVICES)
    ranges = {
        "late": LATE_S, "slow": SLOW_BYTES_PER_S, "lossy": LOSS, "clock": CLOCK_S,
        "disk slow": DISK_SLOWER,
    }  # fmt: skip
    amount = 0.0
    if kind in ranges:
        low, high = ranges[kind]
        amount = float(f"{low * (high / low) ** rng.random():.3g}")
    if kind == "clock":
        amount *= rng.choice((-1.0, 1.0))
        target = rng.choice((*SERVICES, "all"))
    if kind in ("doubled", "silent", "disordered", "frozen"):
        target = rng.choice(STREAMS)
    if kind in ("damaged", "garbled", "not finite"):
        target = rng.choice(CHECKED)
    if kind in ("jumping", "lying"):
        target = ROBOT_ODOMETRY.key
    if kind == "queued":
        target = ROBOT_CMD_VEL.key
    if kind.startswith("disk"):
        target = rng.choice(DISKS)
    if kind == "power":
        target = rng.choice((*DISKS, "all"))
    if kind == "suspend":
        target = rng.choice((*SERVICES, "all"))
    if kind == "second":
        target = rng.choice((*SERVICES, OTHER_ROBOT))
    if kind == "disk torn":
        target, amount = rng.choice(FILES), round(rng.random(), 2)
    if kind == "router" or kind in ACTS:
        target = ""
    return Incident(kind, at_s, target, lasts_s, amount)


def shrunk(plan: FaultPlan, fails: Callable[[FaultPlan], bool]) -> FaultPlan:
    """The smallest plan that still fails, by leaving out and shortening one thing after another."""
    for smaller in plan.smaller():
        if fails(smaller):
            return shrunk(smaller, fails)
    return plan
