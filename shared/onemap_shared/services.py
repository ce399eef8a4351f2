"""The one list of services: what each is called, the module that runs it, what installs it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Service:
    """A service: ``python -m module`` runs it; ``pip install 'onemap[extra]'`` installs it."""

    name: str
    module: str
    extra: str
    summary: str


ALL = (
    Service("simulator", "onemap_simulator", "simulator", "a simulated robot in an apartment"),
    Service("replay", "onemap_simulator.replay", "simulator", "a recording in place of a robot"),
    Service("perception", "onemap_perception", "perception", "images to features"),
    Service("mapper", "onemap_mapper", "mapper", "features to a map that answers text queries"),
    Service("planner", "onemap_planner", "planner", "search goals, paths, velocity commands"),
    Service("gateway", "onemap_gateway", "gateway", "the HTTP API and the live page"),
)
SERVICES = {service.name: service for service in ALL}
ROBOTS = ("simulator", "replay")  # publish what a real robot would
STAGES = ("perception", "mapper", "planner")  # what every search needs, in the order of the data
