"""The planning thread: asks the map, thinks, and hands over an immutable order.

The map may answer slowly or not at all; whoever steers reads ``outcome``, never waits.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from onemap_planner.inputs import Heard
from onemap_planner.motion.pure_pursuit import Velocity
from onemap_planner.motion.velocity_controller import Order
from onemap_planner.path_message import planned_path
from onemap_planner.policy.competition import rivals_of
from onemap_planner.policy.params import Rules
from onemap_planner.policy.state import Mind, Quest
from onemap_planner.policy.step import Decision, Senses, think
from onemap_planner.registry import Desk
from onemap_planner.search.phases import GivenUp, Moment, Search, Starting
from onemap_planner.search.state_machine import transition
from onemap_shared import keys
from onemap_shared.messages import Detections, SearchReset, SearchView, SearchViewRequest
from onemap_shared.transport import Bus, CallError, Counters, QueryTimeout, RemoteError

LOG = logging.getLogger("onemap.planner")

VIEW_TIMEOUT_S = 1.0  # a view of a large flat takes under 0.1 s
COLLISION_S = 0.3  # one planning period: a report in between is not missed
HOPELESS = frozenset({"invalid", "unknown_word"})  # asking the same again will not help


@dataclass(frozen=True, slots=True)
class Outcome:
    """The newest result of planning. complaint: what the map failed to do, empty if nothing."""

    order: Order | None = None
    complaint: str = ""
    plan_ms: float = 0.0
    view_at_s: float | None = None
    goals: int = 0


@dataclass(frozen=True, slots=True)
class Now:
    """What the steering loop knows: last heard, and the last command sent."""

    heard: Heard
    command: Velocity


class Planning:
    """One thread; ``outcome`` is replaced as a whole, so that it is safe to read any time."""

    def __init__(
        self, bus: Bus, desk: Desk, rules: Rules, *, period_s: float, now: Callable[[], Now]
    ) -> None:
        self._bus, self._desk, self._rules, self._now = bus, desk, rules, now
        self._period_s = period_s
        self._detections = bus.subscribe(keys.DETECTIONS, capacity=8)
        self._paths = bus.publish(keys.SEARCH_PATH)
        self._was_reset: tuple[str, int] | None = None
        if desk.mind is not None:  # what was searched before a restart stays searched
            self._was_reset = _leg(desk.mind.search)
        self.outcome = Outcome()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="planning", daemon=True)
        self._thread.start()

    @property
    def alive(self) -> bool:
        """Whether the thread still runs."""
        return self._thread.is_alive()

    @property
    def detection_counters(self) -> Counters:
        """What became of the detections."""
        return self._detections.counters

    def close(self) -> None:
        """Stop the thread; a call to the map is not waited for."""
        self._stop.set()
        self._thread.join(timeout=2 * VIEW_TIMEOUT_S)

    def _run(self) -> None:
        while not self._stop.is_set():
            began_s = time.monotonic()
            mind = self._desk.mind
            if mind is None or not mind.search.active:
                self._detections.take(0.0)
                self.outcome = Outcome()
            else:
                self._plan(mind)
            self._stop.wait(max(self._period_s - (time.monotonic() - began_s), 0.0))

    def _plan(self, mind: Mind) -> None:
        """One thought on a fresh view of the map."""
        view: SearchView | None = None
        complaint = ""
        try:
            view = self._ask(mind)
        except RemoteError as problem:
            if problem.code in HOPELESS:
                self._give_up(mind, str(problem))
                return
            complaint = f"the map cannot answer: {problem}"
        except QueryTimeout:
            complaint = f"the map has not answered for {VIEW_TIMEOUT_S:g} s"
        except CallError:
            complaint = "the mapper is not there"
        now, now_s = self._now(), time.monotonic()
        senses = Senses(
            now_s=now_s,
            pose=now.heard.pose,
            odometer_m=now.heard.odometer_m,
            command=now.command,
            collided=now_s - now.heard.collided_s <= COLLISION_S,
            view=view,
            detections=self._new_detections(),
            complaint=complaint or now.heard.complaint(now_s, self._rules.freshness),
        )
        thought, decision = think(mind, senses, self._rules)
        plan_ms = (time.monotonic() - now_s) * 1e3
        if not self._desk.put_back(mind, thought):
            return
        self._hand_over(
            thought, decision, replace(self.outcome, complaint=complaint, plan_ms=plan_ms)
        )

    def _hand_over(self, mind: Mind, decision: Decision | None, outcome: Outcome) -> None:
        """Publish what was decided; without a decision the old order stands and ages."""
        if decision is not None:
            now_s = time.monotonic()
            marks = decision.landmarks
            outcome = replace(
                outcome,
                order=Order(mind.search.search_id, decision, now_s),
                view_at_s=now_s,
                goals=len(marks.frontiers) + len(marks.regions),
            )
            self._paths.put(planned_path(mind.search, decision, time.time_ns()))
        self.outcome = outcome

    def _ask(self, mind: Mind) -> SearchView:
        """The view for the object now sought; a new object first resets what was searched."""
        search = mind.search
        if isinstance(search.phase, Starting) and self._was_reset != _leg(search):
            reset = SearchReset(search.search_id)
            self._bus.call(keys.MAP_SEARCH_RESET, reset, VIEW_TIMEOUT_S)
            self._was_reset = _leg(search)
        rivals = rivals_of(search.target, search.objects, mind.claims, mind.synonyms)
        request = SearchViewRequest(search.target, rivals)
        return self._bus.call(keys.MAP_SEARCH_VIEW, request, VIEW_TIMEOUT_S)

    def _give_up(self, mind: Mind, reason: str) -> None:
        """End the present object: the map will never know this word."""
        heard = self._now().heard
        xy = heard.pose.xy if heard.pose else None
        moment = Moment(time.monotonic(), mind.attentive_s, xy, heard.odometer_m)
        search = transition(mind.search, GivenUp(reason), moment)
        self._desk.put_back(mind, replace(mind, search=search, quest=Quest()))

    def _new_detections(self) -> tuple[Detections, ...]:
        taken = []
        while (message := self._detections.take(0.0)) is not None:
            taken.append(message)
        return tuple(taken)


def _leg(search: Search) -> tuple[str, int]:
    return search.search_id, search.index
