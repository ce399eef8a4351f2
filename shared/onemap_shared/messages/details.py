"""What is said of an object besides its name: colour, relations to other objects, places."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, TypeAlias

from onemap_shared.colours import RANGES
from onemap_shared.messages.checks import Message, Word, cleaned, items
from onemap_shared.messages.places import MAX_PLACES
from onemap_shared.names import indefinite

NEXT_TO_M = 1.0  # between two objects that are next to each other
MAX_NEGATIVES = 10  # names of what an object is not
MAX_RELATIONS = 3  # of one object: "in the kitchen, on the table, next to the sink"


def _check_colour(colour: str, name: str) -> None:
    if colour and colour not in RANGES:
        raise ValueError(f"{name} is {colour[:40]!r}; known are {', '.join(RANGES)}")


Colour: TypeAlias = Annotated[str, _check_colour]
Negatives: TypeAlias = Annotated[tuple[str, ...], items(MAX_NEGATIVES), cleaned("negative")]


class RelationKind(Word):
    """How an object lies to another one, its anchor; ``between``: to two of them."""

    NEXT_TO = "next_to"
    ON = "on"
    UNDER = "under"
    IN = "in"
    BETWEEN = "between"

    @property
    def words(self) -> str:
        """As one says it: "next to"."""
        return self.value.replace("_", " ")


@dataclass(frozen=True, slots=True)
class Relation(Message):
    """What an object lies next to, on, under, in or between.

    Attributes:
        kind: how it lies to them.
        anchors: names of the other objects: two for ``between``, else one.
    """

    kind: RelationKind
    anchors: Annotated[tuple[str, ...], cleaned("anchor")]

    def _check(self) -> None:
        wanted = 2 if self.kind is RelationKind.BETWEEN else 1
        if len(self.anchors) != wanted:
            raise ValueError(f"{self.kind} has {len(self.anchors)} anchors; it needs {wanted}")


@dataclass(frozen=True, slots=True)
class Detail(Message):
    """What is said of an object besides its name; all empty: nothing.

    Attributes:
        colour: a name of ``colours.RANGES``; ranks cells, and is checked in the picture of a find.
        relations: all must hold.
        inside: names of places: it lies in one of them.
        outside: names of places: it lies in none of them.
        negatives: names of what it is not: they compete with its own.
    """

    colour: Colour = ""
    relations: Annotated[tuple[Relation, ...], items(MAX_RELATIONS)] = ()
    inside: Annotated[tuple[str, ...], items(MAX_PLACES), cleaned("place")] = ()
    outside: Annotated[tuple[str, ...], items(MAX_PLACES), cleaned("place")] = ()
    negatives: Negatives = ()

    def of(self, name: str) -> str:
        """An object of this name, so described, in words: "lamp next to a bed"."""
        words = [self.colour, name]
        for relation in self.relations:
            words += [relation.kind.words, " and ".join(map(indefinite, relation.anchors))]
        for where, names in (("in", self.inside), ("not in", self.outside)):
            words += [f"{where} the {' or the '.join(names)}"] if names else []
        words += [f"not {' or '.join(map(indefinite, self.negatives))}"] if self.negatives else []
        return " ".join(filter(None, words))

    @property
    def located(self) -> bool:
        """Whether it says anything of where the object is."""
        return bool(self.relations or self.inside or self.outside)

    @property
    def anchors(self) -> tuple[str, ...]:
        """The names of all other objects, each once."""
        return tuple(dict.fromkeys(name for each in self.relations for name in each.anchors))


NO_DETAIL = Detail()


class Holds(Word):
    """Whether a condition holds.

    ``not_checked``: a closer look may tell; ``not_known``: nothing that is seen there will, as of a
    place that the map does not show.
    """

    YES = "yes"
    NO = "no"
    NOT_CHECKED = "not_checked"
    NOT_KNOWN = "not_known"


@dataclass(frozen=True, slots=True)
class CheckedCondition(Message):
    """What is said of an object, checked for one thing of its name.

    Attributes:
        what: the condition, as it is said: "next to a bed".
        holds: of this thing.
        evidence: how it is known, or what is the matter, in words: "0.6 m from the bed".
    """

    what: str
    holds: Holds
    evidence: str


def all_hold(conditions: Iterable[CheckedCondition]) -> Holds:
    """Whether all of them hold: the first of no, not checked and not known that one has."""
    found = {each.holds for each in conditions}
    return next((each for each in tuple(Holds)[1:] if each in found), Holds.YES)


def evidence_for(conditions: Iterable[CheckedCondition]) -> tuple[str, ...]:
    """What holds, in words."""
    return tuple(each.evidence for each in conditions if each.holds is Holds.YES)


def evidence_missing(conditions: Iterable[CheckedCondition]) -> tuple[str, ...]:
    """What does not hold, or was not checked, in words."""
    return tuple(each.evidence for each in conditions if each.holds is not Holds.YES)
