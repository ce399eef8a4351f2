"""How the search for an object ended: why it failed, how much was covered, what was seen."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class FailureCode(str, Enum):
    """Why a search failed: the closed list; empty for what did not fail."""

    NONE = ""
    TIME_LIMIT = "time_limit"
    DISTANCE_LIMIT = "distance_limit"
    STUCK = "stuck"
    NO_INPUT = "no_input"
    UNREACHABLE = "unreachable"
    UNKNOWN_WORD = "unknown_word"
    MAP_REFUSED = "map_refused"

    def __str__(self) -> str:
        return self.value

    @property
    def sentence(self) -> str:
        """What it means, whatever the search; empty for none."""
        return _SENTENCES[self]


_SENTENCES = {
    FailureCode.NONE: "",
    FailureCode.TIME_LIMIT: "The time limit of the search, or of one object, was reached.",
    FailureCode.DISTANCE_LIMIT: "The robot drove as far as the search allows.",
    FailureCode.STUCK: "The robot cannot get away from where it stands.",
    FailureCode.NO_INPUT: "Odometry or map were missing, or too old to act on, for too long.",
    FailureCode.UNREACHABLE: "No way leads to the place, or to a view of it.",
    FailureCode.UNKNOWN_WORD: "The encoder of the map does not know the word.",
    FailureCode.MAP_REFUSED: "The map cannot answer for this name.",
}


@dataclass(frozen=True, slots=True)
class Coverage:
    """What a search that found nothing has looked at.

    Attributes:
        explored_m2: free floor that was seen well enough, in square metres.
        free_m2: free floor that was seen at all.
        unreachable_m2: free floor with room for the robot that no path leads to.
        best_match_m: x, y of where the map resembles the object most; empty without features.
        best_score: similarity there, in [0, 1].
    """

    explored_m2: float = 0.0
    free_m2: float = 0.0
    unreachable_m2: float = 0.0
    best_match_m: tuple[float, ...] = ()
    best_score: float = 0.0


NO_COVERAGE = Coverage()
