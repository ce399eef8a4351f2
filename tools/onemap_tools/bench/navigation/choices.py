"""What ``onemap bench navigation`` is asked to run; imports nothing, the command line reads it."""

from __future__ import annotations

from enum import Enum


class Method(str, Enum):
    """The methods that are compared."""

    ONEMAP = "onemap"
    ONEMAP_RESET = "onemap_reset"
    ONEMAP_NO_CONSENSUS = "onemap_no_consensus"
    VLFM = "vlfm"
    NEAREST_FRONTIER = "nearest_frontier"
    ORACLE = "oracle"


class Features(str, Enum):
    """What perception is made of; uncalibrated: simulated, with scores like CLIP's."""

    SIMULATED = "simulated"
    UNCALIBRATED = "uncalibrated"
    MINI = "mini"


class Apartments(str, Enum):
    """Which seeds of apartments: settings are chosen on the even ones, odd ones are reported."""

    ALL = "all"
    EVEN = "even"
    ODD = "odd"


class ObjectOrder(str, Enum):
    """In which order the objects of an episode are sought."""

    GIVEN = "given"
    ANY = "any"


class Errors(str, Enum):
    """Which errors of a real robot are simulated; jump: drift that loop closures set right."""

    NONE = "none"
    DRIFT = "drift"
    JUMP = "jump"
    LATE = "late"
    DROPPED = "dropped"
    DEPTH = "depth"
    PEOPLE = "people"
    ALL = "all"
