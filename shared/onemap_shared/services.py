"""The one list of services: what each is called, the module that runs it, what installs it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version


@dataclass(frozen=True, slots=True)
class Service:
    """A service: ``python -m module`` runs it; ``pip install -e '.[extra]'`` installs it."""

    name: str
    module: str
    extra: str
    summary: str


ALL = (
    Service("simulator", "onemap_simulator", "simulator", "a simulated robot in an apartment"),
    Service("replay", "onemap_simulator.replay", "simulator", "a recording in place of a robot"),
    Service("ros2", "onemap_ros2", "ros2", "a ROS 2 robot over rmw_zenoh, without ROS 2"),
    Service("perception", "onemap_perception", "perception", "images to features"),
    Service("mapper", "onemap_mapper", "mapper", "features to a map that answers text queries"),
    Service("planner", "onemap_planner", "planner", "search goals, paths, velocity commands"),
    Service("gateway", "onemap_gateway", "gateway", "the HTTP API and the live page"),
)
SERVICES = {service.name: service for service in ALL}
ROBOTS = ("simulator", "replay", "ros2")  # publish what a real robot would
STAGES = ("perception", "mapper", "planner")  # what every search needs, in the order of the data
DRIVER = "robot"  # the name under which a robot's driver joins the bus
SOLE = (DRIVER, *STAGES)  # of each of these roles one process may be on a set of keys


def role_of(service: str) -> str:
    """What a process of this service does on the bus: all robots have one role."""
    return DRIVER if service in ROBOTS else service


def doubled(members: Iterable[tuple[str, str]]) -> Mapping[str, tuple[str, ...]]:
    """The roles that more than one process has, with the processes' names, sorted.

    members: service and instance of every process on the bus.
    """
    named: dict[str, list[str]] = {}
    for service, instance in sorted(members):
        named.setdefault(role_of(service), []).append(f"{service} {instance}")
    return {role: tuple(named[role]) for role in SOLE if len(named.get(role, ())) > 1}


def doubled_sentence(role: str, names: tuple[str, ...]) -> str:
    """What is wrong when several processes have one role, without what to do."""
    return f"{len(names)} processes run as the {role} ({', '.join(names)}): their messages mix"


@cache
def installed_version() -> str:
    """The version of OneMap that this process runs; empty if it is not installed."""
    try:
        return version("onemap")
    except PackageNotFoundError:
        return ""
