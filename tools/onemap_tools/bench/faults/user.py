"""What a user does in a run, over HTTP, and what was said to have been done."""

from __future__ import annotations

import random
from contextlib import suppress
from functools import partial
from math import cos, sin
from typing import Any

from onemap_shared.clock import Clock
from onemap_simulator.service import SimulatorWorker
from onemap_tools.bench.faults.plan import FaultPlan
from onemap_tools.bench.faults.rules import STOPPED_S, Refused, Rules, Zone
from onemap_tools.virtual.asgi import VirtualGateway
from onemap_tools.virtual.network import VirtualBus
from onemap_tools.virtual.system import VirtualSystem

ZONE_M, AHEAD_M = 0.8, 1.2  # side of a zone, and from the robot to its middle
SAVED = "kept"
ASKS_EVERY_S = 0.5
# Of the map, its files and, with a text, of perception: more than one is asked at a time.
READS = (("GET", "/v1/objects"), ("GET", "/v1/maps"), ("POST", "/v1/queries")) * 3
READS_S = 0.1  # before a stop is asked for


class User:
    """Searches as long as the plan says; its acts are called by the names in ``plan.ACTS``."""

    def __init__(
        self, system: VirtualSystem, rules: Rules, names: list[str], plan: FaultPlan
    ) -> None:
        self._system, self._rules, self._names = system, rules, names
        self._rng = random.Random(f"user {plan.seed}")
        self._plan = plan
        self._search_id = ""
        self.searches, self.active_s = 0, 0.0  # active_s: when a search was last active
        self._zones = 0

    def ask(self, clock: Clock, method: str, path: str, body: object = None) -> dict[str, Any]:
        """The document of a request; raises ``Refused``."""
        service = self._system.services["gateway"]
        gateway = service.worker
        if not service.process.alive or not isinstance(gateway, VirtualGateway):
            raise Refused("connection", "nobody listens")
        try:
            status, document = gateway.request(clock, method, path, body)
        except ConnectionError as problem:
            raise Refused("connection", str(problem)) from problem
        if status == 500:
            self._rules.tell("error", f"{method} {path}: {document}")
        if status >= 400:
            code = str(document.get("type")).rpartition("problem-")[2]
            raise Refused(code, str(document.get("detail")))
        return document

    def search(self, bus: VirtualBus) -> None:
        """Search, again and again; returns once nothing more is asked and no search is active."""
        world = self._system.world
        while True:
            bus.clock.sleep(ASKS_EVERY_S)
            try:
                if self._search_id and self._still_active(bus):
                    self.active_s = world.now_s
                elif world.now_s < self._plan.asks_until_s:
                    self._begin(bus, {"objects": [self._rng.choice(self._names)]})
                else:
                    return
            except Refused:  # it asks again
                continue

    def _begin(self, bus: VirtualBus, what: dict[str, Any]) -> None:
        self._search_id = str(self.ask(bus.clock, "POST", "/v1/searches", what)["id"])
        self.searches += 1
        self.active_s = self._system.world.now_s

    def _still_active(self, bus: VirtualBus) -> bool:
        search_id = self._search_id
        try:
            search = self.ask(bus.clock, "GET", f"/v1/searches/{search_id}")
        except Refused as problem:
            if problem.code == "unknown_search":  # of a planner whose computer has lost it
                self._search_id = ""
            raise
        if search["active"] and search_id in self._rules.cancelled:
            self._rules.tell("cancelled", f"search {search_id} goes on after it was cancelled")
        for result in search["results"]:
            if result["outcome"] == "found":
                self._rules.found(search_id, str(result["name"]))
        return bool(search["active"])

    # What is done besides.

    def act(self, name: str, bus: VirtualBus) -> None:
        """Do it; a refusal is taken."""
        with suppress(Refused):
            getattr(self, f"_{name}")(bus.clock)

    def _cancel(self, clock: Clock) -> None:
        for method, path in READS:
            self._system.spawn_user(partial(self._read, method, path))
        clock.sleep(READS_S)
        asked_s = self._system.world.now_s
        try:
            search = self.ask(clock, "DELETE", "/v1/searches/current")
        finally:
            now_s = self._system.world.now_s
            took_s, passes = now_s - asked_s, ("gateway", "planner")
            if took_s > STOPPED_S and not self._plan.disturbs(passes, asked_s, now_s):
                self._rules.tell("stop", f"it took {took_s:.1f} s until a stop was answered")
        self._rules.cancelled.add(str(search["id"]))

    def _drive(self, clock: Clock) -> None:
        self._cancel(clock)
        x, y, yaw = self._pose()
        goal = [round(x + cos(yaw), 2), round(y + sin(yaw), 2)]
        self.ask(clock, "POST", "/v1/searches", {"go_to_m": goal})

    def _save(self, clock: Clock) -> None:
        self.ask(clock, "PUT", f"/v1/maps/{SAVED}")
        self._rules.saved = True

    def _load(self, clock: Clock) -> None:
        self._rules.forget_zones()  # those of the file take their place
        self.ask(clock, "POST", f"/v1/maps/{SAVED}/load")

    def _merge(self, clock: Clock) -> None:
        self.ask(clock, "POST", f"/v1/maps/{SAVED}/merge", {})

    def _clear(self, clock: Clock) -> None:
        self._rules.forget_zones()
        self.ask(clock, "POST", "/v1/map/clear")

    def _read(self, method: str, path: str, bus: VirtualBus) -> None:
        body = {"text": self._rng.choice(self._names)} if method == "POST" else None
        with suppress(Refused):
            self.ask(bus.clock, method, path, body)

    def _ask(self, clock: Clock) -> None:
        self.ask(clock, "POST", "/v1/queries", {"text": self._rng.choice(self._names)})

    def _name(self, clock: Clock) -> None:
        x, y, _ = self._pose()
        self.ask(clock, "PUT", "/v1/places/den", {"inside_m": [round(x, 2), round(y, 2)]})

    def _zone(self, clock: Clock) -> None:
        """Draw a keep-out zone ahead of the robot."""
        x, y, yaw = self._pose()
        middle = x + AHEAD_M * cos(yaw), y + AHEAD_M * sin(yaw)
        (x0, y0), (x1, y1) = ((c - ZONE_M / 2 for c in middle), (c + ZONE_M / 2 for c in middle))
        corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
        name, self._zones = f"zone {self._zones}", self._zones + 1
        forgotten = self._rules.forgotten
        body = {"corners_m": corners, "kind": "keep_out"}
        self.ask(clock, "PUT", f"/v1/places/{name}", body)
        if self._rules.forgotten == forgotten:  # else by whom came later
            self._rules.zones.append(Zone(name, (x0, y0, x1, y1)))

    def _pose(self) -> tuple[float, float, float]:
        worker = self._system.services["simulator"].worker
        if not isinstance(worker, SimulatorWorker):
            raise Refused("connection", "no robot")
        state = worker._simulation.state
        return state.x_m, state.y_m, state.yaw_rad
