"""Whether a search goes on by itself after its planner was away. When in doubt, it does not.

A robot that nobody has sent must not move: not at boot, not days later, not in another place.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timezone
from math import dist

from onemap_planner.search.phases import Search
from onemap_shared.messages import SearchState

MAX_AWAY_S = 60.0  # a restarted planner is back in 2 to 30 s; later nobody expects a robot to start
MAX_MOVED_M = 2.0  # it drives on and brakes after the last record, under 1.1 m at 0.7 m/s


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a search rests on beside its planner. Empty, 0 or None: not known.

    namespace: of the robot's keys. boot_id: of the start of the planner's computer; boot_s: seconds
    since then, also those in suspend: clocks of the day may jump. robot: its process. map_id: of
    the map in the running mapper; another one after clear, load and restart. odometry: number of
    the robot's newest message, xy_m: where it was.
    """

    namespace: str = ""
    boot_id: str = ""
    boot_s: float = 0.0
    robot: str = ""
    map_id: str = ""
    odometry: int = -1
    xy_m: tuple[float, float] | None = None

    @property
    def known(self) -> bool:
        """Whether robot and map were heard."""
        return bool(self.robot and self.map_id and self.odometry >= 0 and self.xy_m)


def interruption(then: Surroundings, now: Surroundings) -> str:
    """Why a search that was active then has ended; empty if it may go on.

    What is not known yet of ``now`` speaks neither for nor against it: it must be ``now.known``
    before the robot moves. What was not known then ends the search.
    """
    away_s = now.boot_s - then.boot_s
    moved_m = dist(now.xy_m, then.xy_m) if now.xy_m and then.xy_m else 0.0
    table = (
        (not (then.known and then.boot_id), "it is not known what else was restarted"),
        (now.boot_id != then.boot_id, "the planner's computer was started anew"),
        (not 0.0 <= away_s <= MAX_AWAY_S, f"the planner was away for {away_s:.0f} s"),
        (now.namespace != then.namespace, f"its robot was that of the keys {then.namespace!r}"),
        (now.robot not in ("", then.robot), "the robot was started anew"),
        (now.map_id not in ("", then.map_id), "the map is another one"),
        (0 <= now.odometry < then.odometry, "the robot counts its poses anew"),
        (not moved_m <= MAX_MOVED_M, f"the robot is {moved_m:.1f} m from where it was"),
    )
    return next((why for ended, why in table if ended), "")


def interrupted_reason(search: Search, why: str, at_ns: int) -> str:
    """Why and when a search was interrupted, and what was found, in one sentence."""
    at = datetime.fromtimestamp(at_ns / 1e9, tz=timezone.utc)
    found = [each.name for each in search.results if each.outcome is SearchState.FOUND]
    what = f"; found before: {', '.join(found)}" if found else ""
    return f"interrupted at {at:%Y-%m-%d %H:%M:%S} UTC: {why}{what}"
