"""The planner on the bus: the runner's loop listens, steers and announces; a thread plans."""

from __future__ import annotations

import logging
import math
import time
import uuid
from contextlib import suppress

from onemap_planner import words
from onemap_planner.config import PlannerConfig
from onemap_planner.inputs import Heard, hear_odometry, hear_revision
from onemap_planner.motion.velocity_controller import Helm, HelmSenses, tick
from onemap_planner.planning_thread import Now, Planning
from onemap_planner.policy.competition import Synonyms, synonyms_of
from onemap_planner.registry import Desk, DeskError
from onemap_planner.search.phases import Moment, Search
from onemap_planner.search.state_machine import journal, status
from onemap_shared import keys
from onemap_shared.messages import (
    SearchId,
    SearchRequest,
    SearchStatus,
    VelocityCommand,
    check_text,
)
from onemap_shared.text_embedding import embed_texts
from onemap_shared.transport import (
    Bus,
    Counters,
    Health,
    RequestRejected,
    Worker,
)

LOG = logging.getLogger("onemap.planner")

ANNOUNCE_S = 1.0
EMBED_TIMEOUT_S = 1.5  # for all words of a search; the gateway gives the whole call 3 s
SYNONYMS_TIMEOUT_S = 0.5  # the same once more with the names found before
IDLE_AGE_S = 5.0  # without a search, only a silence this long is worth a word


class Planner:
    """Implements ``transport.Worker``."""

    def __init__(self, bus: Bus, config: PlannerConfig) -> None:
        now_s = time.monotonic()
        self._bus, self._config, self._rules = bus, config, config.rules()
        self._odometry = bus.subscribe(keys.ROBOT_ODOMETRY)
        self._revisions = bus.subscribe(keys.MAP_REVISION)
        self._commands = bus.publish(keys.ROBOT_CMD_VEL)
        self._states = bus.publish(keys.SEARCH_STATE)
        self._desk = Desk(_recorded(config, now_s))
        self._heard = Heard()
        self._helm = Helm()
        self._sent = self._refused = 0
        self._ticked_s = [now_s]  # of the last second
        self._next_tick_s = self._next_announcement_s = now_s
        self._announced: tuple[object, ...] = ()
        self._planning = Planning(
            bus,
            self._desk,
            self._rules,
            period_s=1.0 / config.plan_hz,
            now=lambda: Now(self._heard, self._helm.command),
        )
        bus.serve(keys.SEARCH_START, self._start)
        bus.serve(keys.SEARCH_CANCEL, self._cancel)
        bus.serve(keys.SEARCH_GET, self._get)

    def step(self, timeout_s: float) -> None:
        """Listen until the next command is due, then send it."""
        if not self._planning.alive:
            raise RuntimeError("the planning thread died")
        wait_s = min(timeout_s, max(self._next_tick_s - time.monotonic(), 0.0))
        odometry = self._odometry.take(wait_s)
        now_s = time.monotonic()
        if odometry is not None:
            self._heard = hear_odometry(self._heard, odometry, now_s)
        revision = self._revisions.take(0.0)
        if revision is not None:
            maps = self._heard.maps
            self._heard = hear_revision(self._heard, revision, now_s)
            if self._heard.maps > maps:
                self._desk.forget_finds()
        if now_s >= self._next_tick_s:
            self._next_tick_s = max(self._next_tick_s + 1.0 / self._config.control_hz, now_s)
            self._ticked_s = [t for t in self._ticked_s if now_s - t < 1.0] + [now_s]
            self._steer(now_s)
            self._announce(now_s)
            self._report_refused()

    def health(self) -> Health:
        """Not ready while the robot or the map is silent; the metrics of planning and control."""
        now_s = time.monotonic()
        age = self._heard.ages(now_s)
        mind = self._desk.mind
        problem = ""
        if mind is not None and mind.search.active:
            problem = self._waiting(now_s)
        elif max(age.odometry_s, age.map_s) > IDLE_AGE_S:
            problem = self._heard.complaint(now_s, self._rules.freshness)
        outcome = self._planning.outcome
        view_age_s = math.inf if outcome.view_at_s is None else now_s - outcome.view_at_s
        metrics = {
            "plan_ms": outcome.plan_ms,
            "view_age_s": view_age_s,
            "odometry_age_s": age.odometry_s,
            "map_age_s": age.map_s,
            "map_lag_s": age.map_lag_s,
            "goals": float(outcome.goals),
            "stops_on_stale": float(self._helm.stops),
            "control_hz": float(len(self._ticked_s)),
        }
        for stream, counters in self._counters().items():
            metrics[f"{stream}_refused"] = float(counters.refused)
        known = {name: value for name, value in metrics.items() if math.isfinite(value)}
        return Health(ready=not problem, problem=problem, metrics=known)

    def close(self) -> None:
        """Stop planning and, if the robot may be moving, the robot."""
        self._planning.close()
        mind = self._desk.mind
        if mind is not None and mind.search.active:
            self._send(0.0, 0.0)
            self._write_record(mind.search, time.monotonic())

    def _steer(self, now_s: float) -> None:
        mind = self._desk.mind
        senses = HelmSenses(
            now_s=now_s,
            search_id=mind.search.search_id if mind is not None and mind.search.active else "",
            pose=self._heard.pose,
            complaint=self._heard.complaint(now_s, self._rules.freshness),
        )
        self._helm, send = tick(self._helm, self._planning.outcome.order, senses, self._rules)
        if send:
            self._send(self._helm.command.linear_mps, self._helm.command.angular_radps)

    def _send(self, linear_mps: float, angular_radps: float) -> None:
        self._sent += 1
        self._commands.put(VelocityCommand(self._sent, time.time_ns(), linear_mps, angular_radps))

    def _announce(self, now_s: float) -> None:
        """The search's state on every change and once a second."""
        mind = self._desk.mind
        if mind is None:
            return
        search, waiting = mind.search, self._waiting(now_s)
        shown = (search.search_id, search.index, search.reason, bool(waiting))
        if shown == self._announced and now_s < self._next_announcement_s:
            return
        if shown[:3] != self._announced[:3]:
            LOG.info("search %s: %s", search.search_id, search.reason)
        self._announced, self._next_announcement_s = shown, now_s + ANNOUNCE_S
        self._states.put(self._status(search, now_s))
        self._write_record(search, now_s)

    def _status(self, search: Search, now_s: float) -> SearchStatus:
        return status(
            search,
            odometer_m=self._heard.odometer_m,
            now_ns=time.time_ns(),
            waiting=self._waiting(now_s),
        )

    def _waiting(self, now_s: float) -> str:
        fresh = self._heard.complaint(now_s, self._rules.freshness)
        return fresh or self._planning.outcome.complaint

    def _counters(self) -> dict[str, Counters]:
        """What became of the messages of each stream."""
        return {
            "odometry": self._odometry.counters,
            "revision": self._revisions.counters,
            "detections": self._planning.detection_counters,
        }

    def _report_refused(self) -> None:
        """Log messages that could not be decoded; they are dropped."""
        counters = self._counters().values()
        refused = sum(counter.refused for counter in counters)
        if refused > self._refused:
            reasons = {counter.last_problem for counter in counters if counter.last_problem}
            LOG.warning("refused %d messages: %s", refused - self._refused, "; ".join(reasons))
            self._refused = refused

    def _write_record(self, search: Search, now_s: float) -> None:
        folder = self._config.state_dir
        if folder is None:
            return
        try:
            journal.save(folder, search, now_s=now_s, odometer_m=self._heard.odometer_m)
        except OSError as problem:
            LOG.error("cannot record the search in %s: %s", folder, problem)

    # Handlers run in threads of the bus.

    def _start(self, request: SearchRequest) -> SearchStatus:
        objects = tuple(check_text(name, "object name") for name in request.objects)
        began_s = time.monotonic()
        try:
            self._desk.refuse_second()
            synonyms = self._check_words(objects)
            self._refuse_late(request, time.monotonic() - began_s)
            search = self._desk.start(
                uuid.uuid4().hex[:12], objects, self._moment(), time.time_ns(), synonyms
            )
        except DeskError as problem:
            raise RequestRejected(problem.code, str(problem)) from problem
        return self._status(search, time.monotonic())

    def _refuse_late(self, request: SearchRequest, took_s: float) -> None:
        """No robot starts for a caller that has given up meanwhile."""
        waited_s = took_s + (keys.SEARCH_START.stale_after_s or 0.0)
        if waited_s > request.patience_s:
            raise RequestRejected(
                "busy",
                f"checking the words took {took_s:.1f} s of the {request.patience_s:g} s that the "
                "caller waits: nothing was started; try again",
            )

    def _check_words(self, objects: tuple[str, ...]) -> Synonyms:
        """Refuse words that perception has no embedding or no place for.

        Returns which of the objects and of the names found before mean the same.
        """
        embeddings = embed_texts(self._bus, objects, EMBED_TIMEOUT_S)
        unplaced = words.unplaced(embeddings)
        if unplaced:
            raise RequestRejected("unknown_word", words.sentence(unplaced), words.details(unplaced))
        mind = self._desk.mind
        found = [claim.name for claim in mind.claims] if mind is not None else []
        if found:
            names = tuple(dict.fromkeys((*objects, *found)))
            with suppress(RequestRejected):  # of another encoder, perhaps: then only spelling tells
                embeddings = embed_texts(self._bus, names, SYNONYMS_TIMEOUT_S)
        return synonyms_of(embeddings)

    def _cancel(self, request: SearchId) -> SearchStatus:
        try:
            search = self._desk.cancel(request.search_id, self._moment())
        except DeskError as problem:
            raise RequestRejected(problem.code, str(problem)) from problem
        return self._status(search, time.monotonic())

    def _get(self, request: SearchId) -> SearchStatus:
        try:
            found = self._desk.find(request.search_id)
        except DeskError as problem:
            raise RequestRejected(problem.code, str(problem)) from problem
        return self._status(found, time.monotonic())

    def _moment(self) -> Moment:
        xy = self._heard.pose.xy if self._heard.pose else None
        return Moment(time.monotonic(), 0.0, xy, self._heard.odometer_m)


def _recorded(config: PlannerConfig, now_s: float) -> Search | None:
    if config.state_dir is None:
        return None
    try:
        search = journal.load(config.state_dir, now_s)
    except journal.RecordError as problem:
        LOG.error("the search that was active is lost: %s", problem)
        return None
    if search is not None:
        LOG.info("going on with search %s for %r", search.search_id, search.target)
    return search


def build(bus: Bus, config: PlannerConfig) -> Worker:
    """The planner on this bus."""
    return Planner(bus, config)
