"""How descriptions of objects are understood on the map of this robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pydantic import Field

from onemap.replies import Reply
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.schemas import Described
from onemap_shared import keys
from onemap_shared.messages import PlacesRequest, TextRequest
from onemap_shared.sentence import Sentence, in_words, is_description, names_of


@dataclass(frozen=True, slots=True)
class Understood:
    """The sentences of a request, in its order.

    Attributes:
        places: names of the map's places; None: no sentence asks for them.
        stands_for: the names for which a description stands, by its text.
    """

    sentences: tuple[Sentence, ...]
    places: tuple[str, ...] | None
    stands_for: Mapping[str, tuple[str, ...]]

    def names(self, sentence: Sentence) -> tuple[str, ...]:
        """The names for which its description stands, but those it excludes; none of a name."""
        return names_of(sentence, self.stands_for)

    def in_words(self, *sentences: Sentence) -> str:
        """How these, or all of them, were understood."""
        return in_words(sentences or self.sentences, self.places, self.stands_for)


class WordsReply(Reply):
    """How a sentence is understood on this map."""

    texts: tuple[str, ...] = Field(description="The sentences that the text lists, mostly one.")
    understood: str = Field(description="In words, as 'lamp, within 1 m of a bed, anywhere'.")
    stands_for: tuple[str, ...] = Field(
        description="Names that are nearest to the last sentence's description; empty for a name."
    )


def _parsed(
    described: Sequence[Described], places: tuple[str, ...] | None = None
) -> list[Sentence]:
    """The sentences; HttpProblem of what only shows with the map's places or all parts."""
    try:
        return [each.sentence(places) for each in described]
    except ValueError as problem:
        raise HttpProblem("invalid", f"{problem}.", 422) from problem


async def understand(gateway: GatewayContext, described: Sequence[Described]) -> Understood:
    """The sentences with the places of the map, and names for descriptions.

    Asks mapper and perception only if these are needed. HttpProblem ``unknown_place`` names the
    places that the map does not know, and those that it does.
    """
    sentences, places = _parsed(described), None
    if any(each.asks_for_places for each in sentences):
        listed = await gateway.call(keys.MAP_PLACES, PlacesRequest())
        places = tuple(place.name for place in listed.places)
        sentences = _parsed(described, places)
        if unknown := [name for each in sentences for name in each.unknown_places(places)]:
            known = (
                f"its places are {', '.join(map(repr, places))}" if places else "it has none yet"
            )
            raise HttpProblem(
                "unknown_place",
                f"The map knows no place {' and no place '.join(map(repr, unknown))}: {known}; "
                "name one with PUT /v1/places/{name}.",
                unknown=unknown,
                places=list(places),
            )
    texts = tuple(each.name for each in sentences if is_description(each.name))
    stands_for: dict[str, tuple[str, ...]] = {}
    if texts:
        embedded = await gateway.call(keys.EMBED_TEXT, TextRequest(texts))
        stands_for = dict(zip(texts, embedded.stands_for or ((),) * len(texts), strict=True))
    return Understood(tuple(sentences), places, stands_for)
