"""What a launcher starts, told on the bus for as long as it runs, so that nobody starts it twice.

The token of a service comes seconds after its launcher decided to start it. The launcher's own
token names all of its services and is there before the first of them.
"""

from __future__ import annotations

import uuid
from collections.abc import Collection, Iterable

from onemap_shared.services import ROBOTS

LAUNCHER = "up"  # the launcher's name on the bus
ANY_ROBOT = (*ROBOTS, "robot")  # the last as examples/my_robot.py calls itself
SEPARATOR = "."


def claim(names: Collection[str]) -> str:
    """The instance under which a launcher of these services joins the bus."""
    return SEPARATOR.join((uuid.uuid4().hex[:12], *names))


def conflicts(processes: Iterable[tuple[str, str]], own: str) -> tuple[str, ...]:
    """Who is there that the launcher with the claim ``own`` would start a second time, sorted.

    ``processes``: service and instance of every process on the bus. A robot is a rival of any
    other robot, because a map follows one; robots of other launchers and drivers count.
    """
    wanted = set(own.split(SEPARATOR)[1:])
    there: set[str] = set()
    for service, instance in processes:
        if service != LAUNCHER:
            there.add(service)
        elif instance != own:
            there.update(instance.split(SEPARATOR)[1:])
    robots = set(ANY_ROBOT) if wanted.intersection(ROBOTS) else set()
    return tuple(sorted(there & (wanted | robots)))
