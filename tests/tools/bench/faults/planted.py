"""Defects that were mended, put back one at a time: how many seeds it takes to find each.

``python -m tests.tools.bench.faults.planted [--seeds 200] [NAME ...]`` prints a table.
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, BinaryIO

import pytest

from onemap_gateway.bus.rpc import RpcClient
from onemap_mapper.places import keeper
from onemap_mapper.storage import map_file, worlds
from onemap_mapper.storage.kept import Kept
from onemap_planner import inputs as planner_inputs
from onemap_planner import planning_thread
from onemap_planner import service as planner_service
from onemap_planner.followed_places import FollowedPlaces
from onemap_planner.inputs import LatestInputs
from onemap_planner.motion import pure_pursuit, velocity_controller
from onemap_planner.motion.collision_monitor import CheckedCommand
from onemap_planner.motion.motions import Drive, Motion
from onemap_planner.planning_thread import PlanningThread
from onemap_planner.searches import SearchRegistry
from onemap_planner.service import Planner
from onemap_shared.command_gate import Deadman
from onemap_shared.geometry import Velocity2d
from onemap_tools.bench.faults.plan import drawn
from onemap_tools.bench.faults.run import run_plan
from onemap_tools.virtual.disk import VirtualDisk

Plant = Callable[[pytest.MonkeyPatch], None]


@dataclass(frozen=True, slots=True)
class Defect:
    """What is put back, by a name; the rule that it breaks.

    needs: sets of incidents of each of which a plan has to hold one, or nothing can be seen of it.
    """

    name: str
    rule: str
    plant: Plant
    needs: tuple[frozenset[str], ...] = ()


def endless_command(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Deadman, "command_at", lambda deadman, _: deadman.command)


def nothing_is_stale(patch: pytest.MonkeyPatch) -> None:
    views: dict[int, object] = {}
    asked = PlanningThread._request_view

    def kept_view(thread: PlanningThread, state: object) -> object:
        try:
            views[id(thread)] = asked(thread, state)  # type: ignore[arg-type]
        except Exception:
            if id(thread) not in views:
                raise
        return views[id(thread)]

    patch.setattr(LatestInputs, "stale_reason", lambda *_: "")
    patch.setattr(PlanningThread, "_request_view", kept_view)
    patch.setattr(planning_thread, "view_problem", lambda *_: "")


def straight_on(patch: pytest.MonkeyPatch) -> None:
    pursued = pure_pursuit.target_velocity

    def target(motion: Motion, *others: Any, **options: Any) -> Velocity2d:
        if isinstance(motion, Drive):
            motion = replace(motion, points_xy=motion.points_xy[-1:])
        return pursued(motion, *others, **options)

    def checked(wanted: Velocity2d, *_: object, **__: object) -> CheckedCommand:
        return CheckedCommand(wanted)

    patch.setattr(velocity_controller, "target_velocity", target)
    patch.setattr(velocity_controller, "monitored", checked)


def any_driver(patch: pytest.MonkeyPatch) -> None:
    life = planner_inputs.DriverLife
    patch.setattr(life, "with_odometry", lambda driver, _: replace(driver, count=1))
    patch.setattr(life, "with_members", lambda driver, _: driver)


def zones_are_not_followed(patch: pytest.MonkeyPatch) -> None:
    def follow(places: FollowedPlaces, inputs: LatestInputs, *_: object) -> str:
        places.version = inputs.places_version
        return ""

    patch.setattr(FollowedPlaces, "follow", follow)


def nothing_is_written(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Kept, "_written", lambda *_: nullcontext())


def unreadable_is_empty(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(keeper, "FORM", replace(keeper.FORM, confirm=""))


def nothing_is_synced(patch: pytest.MonkeyPatch) -> None:
    def sync(disk: VirtualDisk, file: IO[bytes]) -> None:
        """Return before the bytes are on disk."""

    patch.setattr(VirtualDisk, "sync", sync)


def maps_in_place(patch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def writing(path: Path) -> Iterator[BinaryIO]:
        with path.open("a+b") as file:
            file.truncate(0)
            yield file

    patch.setattr(map_file, "replacing", writing)


def one_frame_changes_the_world(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(worlds, "CONFIRMING_FRAMES", 1)


def said_once(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(planner_service, "STATUS_PERIOD_S", 1e9)


def stops_wait_for_readers(patch: pytest.MonkeyPatch) -> None:
    def limiter(client: RpcClient, _procedure: Any) -> Any:
        from anyio import CapacityLimiter

        return client._limiters.setdefault("planner", CapacityLimiter(4))

    patch.setattr(RpcClient, "_limiter", limiter)


def cancelled_later(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(SearchRegistry, "cancel", lambda registry, search_id, _: registry.find(search_id))


def a_step_fails(patch: pytest.MonkeyPatch) -> None:
    def log_refused(planner: Planner) -> None:
        if planner._registry.state is not None and planner._sent > 50:
            raise RuntimeError("planted")

    patch.setattr(Planner, "_log_refused", log_refused)


def a_thread_fails(patch: pytest.MonkeyPatch) -> None:
    def detections(thread: PlanningThread) -> tuple[()]:
        raise RuntimeError("planted")

    patch.setattr(PlanningThread, "_new_detections", detections)


SLOW = {"stall", "suspend", "cut", "late", "slow", "lossy", "disk slow"}
LOST = {"stall", "suspend", "cut", "router", "silent", "disordered", "frozen", "slow", "lossy"}
RESTARTS, ZONES = {"kill", "restart", "power", "disk torn"}, {"zone"}
DEFECTS = tuple(
    Defect(plant.__name__.replace("_", " "), rule, plant, tuple(map(frozenset, needs)))
    for rule, plant, *needs in (
        ("age", nothing_is_stale),
        ("contact", straight_on),
        ("request", endless_command),
        ("request", any_driver),
        ("cancelled", cancelled_later, {"cancel", "drive"}),
        ("stop", stops_wait_for_readers, {"cancel", "drive"}, SLOW),
        ("zone", zones_are_not_followed, ZONES),
        ("kept", nothing_is_written, ZONES, RESTARTS),
        ("kept", unreadable_is_empty, ZONES, {"disk torn"}),
        ("kept", nothing_is_synced, {"power"}),
        ("kept", maps_in_place, {"save"}, RESTARTS),
        ("kept", one_frame_changes_the_world, ZONES, {"garbled"}),
        ("http", said_once, LOST),
        ("exit", a_step_fails),
        ("crash", a_thread_fails),
    )
)


def seeds_until_found(defect: Defect, seeds: int) -> int:
    """How many seeds it takes until the defect's rule is broken; 0: it was not.

    Plans that lack what the defect needs count as others do, but are not run.
    """
    with pytest.MonkeyPatch.context() as patch:
        defect.plant(patch)
        for seed in range(1, seeds + 1):
            plan = drawn(seed)
            kinds = {incident.kind for incident in plan.incidents}
            if not all(kinds & needed for needed in defect.needs):
                continue
            if any(each.rule == defect.rule for each in run_plan(plan).broken):
                return seed
    return 0


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    logging.disable(logging.CRITICAL)
    print("| rule | defect | seeds |\n|---|---|---|")
    for defect in DEFECTS:
        if not options.names or defect.name in options.names:
            found = seeds_until_found(defect, options.seeds) or f"more than {options.seeds}"
            print(f"| {defect.rule} | {defect.name} | {found} |", flush=True)


if __name__ == "__main__":
    main()
