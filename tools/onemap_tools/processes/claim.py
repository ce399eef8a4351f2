"""Claims on the bus: which services a launcher runs, so that none is started twice.

The liveliness token of a service appears seconds after its launcher has decided to start it.
The launcher's own token names all of its services and is declared before the first of them
starts.
"""

from __future__ import annotations

import uuid
from collections.abc import Collection, Iterable

from onemap_shared.services import DRIVER, ROBOTS

LAUNCHER = "up"  # name of a launcher on the bus
ANY_ROBOT = (*ROBOTS, DRIVER)
SEPARATOR = "."


def claim(names: Collection[str]) -> str:
    """The instance name under which a launcher of these services connects to the bus."""
    return SEPARATOR.join((uuid.uuid4().hex[:12], *names))


def conflicts(processes: Iterable[tuple[str, str]], own: str) -> tuple[str, ...]:
    """Services on the bus that the launcher with the claim ``own`` would start again, sorted.

    ``processes``: service and instance of every process on the bus. Any two robots conflict,
    because a map follows one robot; those of other launchers and of drivers count.
    """
    wanted = set(own.split(SEPARATOR)[1:])
    running: set[str] = set()
    for service, instance in processes:
        if service != LAUNCHER:
            running.add(service)
        elif instance != own:
            running.update(instance.split(SEPARATOR)[1:])
    robots = set(ANY_ROBOT) if wanted.intersection(ROBOTS) else set()
    return tuple(sorted(running & (wanted | robots)))
