"""Sentences about objects: "the red chair next to the bed in the kitchen, stay out of the hall".

A sentence is the name of an object, with a colour before it or none, and then clauses, each of
words from the table ``CLAUSES`` and one phrase; commas, "and" and "but" may join them. The phrase
names an object; after "in" a place, if the map knows one of this name or it is a room's word.
A question or a command around it ("where is the sofa?") asks for the same (``phrasing``), and what
no part of a request stands for is refused, never left out.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias

from onemap_shared.messages import Detail, Relation, RelationKind, SearchRequest, check_text
from onemap_shared.messages.details import NEXT_TO_M, NO_DETAIL
from onemap_shared.names import ARTICLES, indefinite, normalised, same_name
from onemap_shared.phrasing import asked_for, check_modelled, without_courtesy

# The words of a clause, by the part of the request that says the same.
CLAUSES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "near": ("next to", "near to", "near", "close to", "beside", "by"),
        "on": ("on top of", "on"),
        "under": ("under", "underneath", "below", "beneath"),
        "between": ("between",),
        "in": ("in", "inside of", "inside"),
        "not_in": (
            *("not in", "not inside", "outside of", "outside", "except in", "other than in"),
            *("not one in", "not the one in", "not ones in", "not the ones in"),
            *("anywhere but in", "anywhere but", "anywhere except in", "anywhere except"),
            *("any room except", "any room but"),
        ),
        "negatives": (
            *("not", "no", "neither", "except for", "except", "excluding", "other than", "besides"),
            *(
                "anything but",
                "anything except",
                "apart from",
                "rather than",
                "instead of",
                "that is not",
                "that are not",
            ),
            *("that isn't", "that's not", "which is not", "which are not", "which isn't"),
        ),
        "stay_out_of": (
            *("stay out of", "staying out of", "keep out of", "avoid", "avoiding", "don't enter"),
            *("stay away from", "staying away from", "keep away from", "stay clear of"),
            *("don't go into", "don't go in", "do not enter", "do not go into", "do not go in"),
            *(
                "without entering",
                "without going into",
                "without going through",
                "never enter",
                "never go into",
            ),
        ),
    }
)
RELATIONS = {
    "near": RelationKind.NEXT_TO,
    "on": RelationKind.ON,
    "under": RelationKind.UNDER,
    "between": RelationKind.BETWEEN,
    "in": RelationKind.IN,
}
# Each word of a colour, and the colour that it means.
COLOURS: Mapping[str, str] = MappingProxyType(
    {
        **{name: name for name in ("black", "white", "grey", "red", "orange", "yellow", "green")},
        **{name: name for name in ("blue", "purple", "pink", "brown")},
        **{"gray": "grey", "violet": "purple"},
    }
)
# Kinds of things whose name begins with a colour.
NO_COLOURS = frozenset(
    {"red wine", "white wine", "orange juice", "green tea", "black tea", "white ceiling"}
)
ROOM_WORDS = frozenset(
    {
        *("kitchen", "bathroom", "bedroom", "living room", "dining room", "hallway", "hall"),
        *("corridor", "office", "study", "nursery", "garage", "balcony", "basement", "attic"),
        *("entryway", "entrance", "foyer", "terrace", "den", "cellar", "lobby"),
        *("pantry", "laundry room", "storage room", "guest room", "playroom"),
    }
)
# Words that relate things in a way that no clause says, so that they are refused, not embedded.
NOT_UNDERSTOOD = (
    *("behind", "in front of", "above", "over", "with", "without", "opposite", "around", "against"),
    *("at", "across from", "left of", "right of", "on the left", "on the right", "to the left of"),
    *("to the right of", "that", "which", "where", "not on", "not under", "not near", "not by"),
    *("away from", "far from", "nowhere near", "not from", "not at", "not behind", "not beside"),
    *("not close to", "not too", "never in", "no longer"),
    *("not next to", "not between", "from", "along", "among", "through", "into", "onto", "toward"),
    *("towards", "facing", "off", "within", "to"),
)
UNDERSTOOD = (
    "a sentence names an object, perhaps with a colour before it, and says what it is on, under, "
    "next to, in or between, what it is 'not', 'not in' a place, or 'stay out of' a place"
)
DESCRIPTION = re.compile(
    r"((something|anything)( \w+){0,2}?|somewhere|(a |the )?(thing|things|place|spot|furniture)) "
    r"(to|for|that|which|where|(i|you|we|one) (can|could)) ",
    re.I,
)
WORDS = sorted(
    [*NOT_UNDERSTOOD, *(each for words in CLAUSES.values() for each in words)],
    key=len,
    reverse=True,
)
# What joins clauses, then the words of one: "and" between two things belongs to their names.
# "that is lying on" says "on".
FILLED = (
    r"(?P<that>(?:that|which)(?:['’]s|\s+(?:is|are|stands?|lies|hangs?|sits?))\s+)?"
    r"(?:(?:standing|lying|sitting|hanging|placed|right|somewhere|located|anywhere(?!\s+(?:but|except)\b))\s+)?"
)
JOINT = r"(?:(?P<joint>and|but|or|though|while)\s+)?(?:(?:just|only|preferably|ideally)\s+)?"
CLAUSE_HEAD = rf"{JOINT}{FILLED}(?P<words>{'|'.join(WORDS)})(?=\s|$)"
CLAUSE = re.compile(rf"(?:^|[\s,;]+){CLAUSE_HEAD}", re.I)
SENTENCE_COMMA = re.compile(rf"\s*,(?!\s*{CLAUSE_HEAD})\s*(?:and\s+)?", re.I)
PART_OF = {each: part for part, words in CLAUSES.items() for each in words}
LISTED = re.compile(r"\s*,\s*(?:(?:and|or|nor)\s+)?|\s+(?:and|or|nor)\s+", re.I)
FIRST = re.compile(
    r"(?:first(?!\s+aid)(?:ly)?(?:\s+of\s+all)?|start\s+(?:at|with))[\s,]+(?=\S)", re.I
)
THEN = re.compile(
    r"\s*,?\s+(?:and\s+)?(?:then|also|afterwards|after\s+that|next(?!\s+to)|finally|lastly|"
    r"finish\s+at)\s+(?:to\s+)?",
    re.I,
)
AND_A = re.compile(rf"\s+and\s+(?=(?:{'|'.join(ARTICLES)})\S)", re.I)
SHADES = ("dark ", "light ", "bright ", "pale ")
A_COLOUR = rf"(?:{'|'.join(SHADES)})?(?:{'|'.join(COLOURS)})"
IN_COLOUR = re.compile(
    rf"^(?:{'|'.join(ARTICLES)})?(?P<thing>.+?)(?:\s+(?:in|(?:that|which)(?:['’]s|\s+(?:is|are)))"
    rf"\s+(?P<said>{A_COLOUR})|,?\s+(?:a|the)\s+(?P<one>{A_COLOUR})\s+one)\b",
    re.I,
)
NO_NAMES = frozenset({"one", "ones", "it", "that", "this", "those", "them", "there", "here"})
NO_NAMES |= {"something", "anything", "somewhere", "thing", "things", "place", "nothing"}
NO_NAMES |= {"everything", "stuff"}
OPEN = "it is unclear what lies beside what: parts of one object are joined by 'and'"
CHAIN = 3  # relations in a row, nothing between them, from which it is open what lies beside what
Clause: TypeAlias = tuple[str, str, str]  # part, words, phrase


@dataclass(frozen=True, slots=True)
class Sentence:
    """An object as it was described.

    Attributes:
        name: the noun; the whole text where it is a description, as "something to sit on".
        detail: what was said of it besides its name.
        stay_out: names of places that the robot is not to enter.
    """

    name: str
    detail: Detail = NO_DETAIL
    stay_out: tuple[str, ...] = ()

    def __str__(self) -> str:
        """A sentence that ``parse`` understands so, where the map knows the places."""
        out = (f"stay out of {place}" for place in self.stay_out)
        return ", ".join([self.detail.of(self.name), *out])

    @property
    def asks_for_places(self) -> bool:
        """Whether its meaning depends on the places of the map."""
        kinds = {relation.kind for relation in self.detail.relations}
        said = self.detail.inside or self.detail.outside or self.stay_out
        return bool(said) or RelationKind.IN in kinds

    def unknown_places(self, places: Iterable[str]) -> tuple[str, ...]:
        """Places that it names and the map does not know; a room's word may become one later."""
        known = set(map(normalised, places))
        named = (*self.detail.inside, *self.detail.outside)
        of_robot = tuple(name for name in self.stay_out if normalised(name) not in known)
        later = known | ROOM_WORDS
        return tuple(name for name in named if normalised(name) not in later) + of_robot


def is_description(text: str) -> bool:
    """Whether a text says what a thing is for instead of its name: "something to sit on"."""
    return DESCRIPTION.match(text.strip()) is not None


def parse(
    text: str,
    places: Collection[str] | None = None,
    parts: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Sentence:
    """What a sentence says, together with ``parts`` that say more of the same object.

    places: names of the map's places, which "in" may name beside rooms; None: not asked yet, so
    that any name may be one. parts: the phrases of
    each key of ``CLAUSES``, two for ``between``; and of ``colour`` one of ``COLOURS``.

    A text without clauses and colour is a name, and stays as it is. ValueError names the words
    that are not understood.
    """
    known = {normalised(place): place for place in places or ()}
    noun, clauses = _split(_colour_first(asked_for(check_text(text))), known)
    relations: list[Relation] = []
    named: dict[str, list[str]] = {"in": [], "not_in": [], "stay_out_of": [], "negatives": []}
    for part, words, phrase in [*clauses, *_clauses(parts)]:
        listed = _listed(phrase, known) if part in named else {}
        if not phrase:
            raise _not_understood(words, "it names nothing")
        if (part == "in" and not all(listed.values())) or part not in named:
            if part != "in" or places is not None:
                check_modelled(phrase)
            relations.append(_relation(part, words, phrase, known))
        else:
            named[part] += [place or _thing(name) for name, place in listed.items()]
    colour, thing = ("", noun) if is_description(noun) else _object(noun)
    for word in parts.get("colour", ()):
        if colour not in ("", COLOURS.get(word.lower())) or word.lower() not in COLOURS:
            raise _not_understood(word, f"an object has one colour of {', '.join(COLOURS)}")
        colour = COLOURS[word.lower()]
    inside, outside, stay_out, negatives = (tuple(dict.fromkeys(each)) for each in named.values())
    for each in negatives:
        _check_excluded(each, thing)
    detail = Detail(colour, tuple(relations), inside, outside, negatives)
    if (detail == NO_DETAIL and not stay_out) or is_description(noun):
        return Sentence(noun, detail, stay_out)
    return Sentence(_thing(thing), detail, stay_out)


def listed_sentences(text: str) -> list[str]:
    """The sentences between the commas that do not begin a clause, "then", and "and the"."""
    plain = without_courtesy(" ".join(text.split()))
    pieces = THEN.sub("\n", FIRST.sub("", plain)).split("\n")
    pieces = [each for piece in pieces for each in _at_commas(piece)]
    said = [each for piece in pieces if piece.strip(" ,;") for each in _joined_by_and(piece)]
    for each in said if len(said) > 1 else ():
        if normalised(each) in ROOM_WORDS:  # "living room, the sofa" means one thing
            raise _not_understood(each, "it is a room: say 'in' before it, after the thing's name")
    return said or [text]


def _at_commas(text: str) -> list[str]:
    """The sentences between commas. ValueError where what follows a comma may as well be of the
    list before it: "avoid the hall, the lab"."""
    pieces = SENTENCE_COMMA.sub("\n", text).split("\n")
    for piece in pieces[:-1]:
        *_, last = [None, *CLAUSE.finditer(piece)]
        if last is not None and _part(last["words"]) in ("not_in", "negatives", "stay_out_of"):
            hint = "say 'or' between the things of a list, and 'then' before another object"
            raise _not_understood(text, hint)
    return pieces


def _joined_by_and(text: str) -> list[str]:
    """The things of "the bed and a sofa", of which nothing more is said."""
    return [text] if CLAUSE.search(asked_for(text)) else AND_A.split(text)


def search_for(sentences: Sequence[Sentence], patience_s: float, **options: Any) -> SearchRequest:
    """The search for what these describe, in this order; options: fields of the request."""
    details = tuple(each.detail for each in sentences)
    return SearchRequest(
        tuple(each.name for each in sentences),
        patience_s,
        details=details if any(each != NO_DETAIL for each in details) else (),
        stay_out=tuple(dict.fromkeys(place for each in sentences for place in each.stay_out)),
        **options,
    )


def _colour_first(text: str) -> str:
    """ "A chair that is red" as "red chair"."""
    said = IN_COLOUR.match(text)
    if said is None or CLAUSE.search(said["thing"]) or is_description(text):
        return text
    rest = text[said.end() :]
    if rest and not rest.startswith(",") and not CLAUSE.match(rest):  # "plant in white pot"
        return text
    return f"{said['said'] or said['one']} {said['thing']}{rest}"


def _split(text: str, known: Mapping[str, str]) -> tuple[str, list[Clause]]:
    """The noun phrase of a sentence and its clauses."""
    found = list(CLAUSE.finditer(text))
    if is_description(text):  # its own words hold "on" and "with"
        found = [each for each in found if _ends_description(each, text, known)]
    starts = [each.start() for each in found] + [len(text)]
    clauses: list[Clause] = []
    in_a_row = 0
    for clause, end in zip(found, starts[1:], strict=True):
        words, phrase = clause["words"], text[clause.end() : end].strip(" ,;")
        part = _part(words)
        if _place(phrase, known):  # "on the balcony", "other than the kitchen"
            part = "in" if words.lower() in ("on", "from") else part
            part = "not_in" if part == "negatives" else part
        either = (clause["joint"] or "").lower() == "or"
        if not part or (either and not part == clauses[-1][0] == "in"):
            raise _not_understood(f"{'or ' if either else ''}{words} {phrase}".strip())
        if clause["that"] and part != "negatives" and clauses and clauses[-1][0] in RELATIONS:
            raise _not_understood(f"{clause[0].strip()} {phrase}", OPEN)
        joined = bool(clause["joint"]) or "," in clause[0] or ";" in clause[0]
        in_a_row = 1 if joined else in_a_row + (part in RELATIONS and not _place(phrase, known))
        if in_a_row >= CHAIN:
            raise _not_understood(text[starts[0] : end].strip(" ,;"), OPEN)
        clauses.append((part, words, phrase))
    return text[: starts[0]].strip(" ,;"), clauses


def _part(words: str) -> str:
    """The part of a request that these words of a clause say; empty if none does."""
    return PART_OF.get(" ".join(words.lower().replace("’", "'").split()), "")


def _ends_description(clause: re.Match[str], text: str, known: Mapping[str, str]) -> bool:
    """Whether a clause within a description is none of its own words: "in the kitchen", "not a"."""
    words = clause["words"].lower()
    if words == "without" or words.startswith("not "):
        return True
    part = _part(clause["words"])
    place = re.split(r"[,;]|\s(?:and|but|or|not)\s", text[clause.end() :].strip())[0]
    return part in ("not_in", "stay_out_of", "negatives") or (
        part == "in" and bool(_place(place, known))
    )


def _clauses(parts: Mapping[str, Sequence[str]]) -> list[Clause]:
    """The parts as clauses."""
    pair = [("between", "between", " and ".join(two)) for two in [parts.get("between", ())] if two]
    others = [part for part in parts if part in CLAUSES and part != "between"]
    return pair + [(part, part.replace("_", " "), each) for part in others for each in parts[part]]


def _not_understood(words: str, hint: str = UNDERSTOOD) -> ValueError:
    return ValueError(f"{words!r} is not understood: {hint}")


def _listed(phrase: str, known: Mapping[str, str]) -> dict[str, str]:
    """The names that a phrase lists, and the place of each; empty if it is none."""
    names = [phrase] if normalised(phrase) in known else LISTED.split(phrase)
    return {name: _place(name, known) for name in names}


def _place(phrase: str, known: Mapping[str, str]) -> str:
    """The place of this name, as the map spells it; empty if the map knows none and it does not
    end as a room's word."""
    name = normalised(phrase)
    is_room = name in ROOM_WORDS or name.endswith((" room", " bedroom", " bathroom"))
    return known.get(name) or (name if is_room else "")


def _relation(part: str, words: str, phrase: str, known: Mapping[str, str]) -> Relation:
    names = re.split(r"\s+and\s+", phrase, flags=re.I) if part == "between" else [phrase]
    if part == "between" and len(names) != 2:
        raise _not_understood(f"{words} {phrase}", "say 'between the A and the B'")
    for name in names:
        if part != "in" and _place(name, known):
            hint = "an object is 'in' or 'not in' a place"
            raise _not_understood(f"{words} {name}", hint)
        if _coloured(name)[0]:
            hint = "a colour is said only of the object itself, not of what is beside it"
            raise _not_understood(f"{words} {name}", hint)
    return Relation(RELATIONS[part], tuple(map(_thing, names)))


def _object(noun: str) -> tuple[str, str]:
    """Colour, or none, and name of the thing that is sought; ValueError if it is none."""
    colour, thing = _coloured(noun)
    check_modelled(noun)
    check_modelled(_thing(thing))
    return colour, thing


def _check_excluded(name: str, thing: str) -> None:
    """ValueError if this cannot be what the thing is not."""
    check_modelled(name)
    if name.lower() in COLOURS or _coloured(name)[0]:
        raise _not_understood(f"not {name}", "a colour can be asked for, not excluded")
    if same_name(thing, name):
        raise _not_understood(f"not {name}", "the object itself is excluded")


def _coloured(phrase: str) -> tuple[str, str]:
    """The colour that a phrase begins with, or none, and the noun."""
    plain = _bare(phrase)
    shade = next((len(each) for each in SHADES if plain.lower().startswith(each)), 0)
    word, _, noun = plain[shade:].partition(" ")
    kind = " ".join(plain.lower().split()[:2])
    if word.lower() not in COLOURS or not noun or kind in NO_COLOURS:
        return "", plain
    return COLOURS[word.lower()], noun


def _bare(phrase: str) -> str:
    """The phrase without its article, in its own case."""
    start = next((len(each) for each in ARTICLES if phrase.lower().startswith(each)), 0)
    return phrase[start:].strip()


def _thing(phrase: str) -> str:
    """The name of one object or place without its article; ValueError if it is none."""
    if not (name := _bare(phrase)):
        raise ValueError(f"the sentence names no object: {UNDERSTOOD}")
    if LISTED.search(name):
        hint = "name one thing at a time, or give a list of several"
        raise _not_understood(name, hint)
    if CLAUSE.search(name) or name.lower() in NO_NAMES:
        raise _not_understood(name, "this must be the name of one thing or place")
    return name


def names_of(sentence: Sentence, stands_for: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """The names for which its description stands, as of its text, without those it excludes."""
    excluded = sentence.detail.negatives
    names = stands_for.get(sentence.name, ())
    return tuple(name for name in names if not any(same_name(name, no) for no in excluded))


def in_words(
    sentences: Sequence[Sentence],
    places: Collection[str] | None = None,
    stands_for: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> str:
    """How sentences were understood: "lamp, within 1 m of a bed, anywhere".

    places: names of the map's places, to say which rooms are not known yet; None: do not say.
    stands_for: names for which a description stands, by its text. The robot stays out of the places
    of all sentences at once, so these come last.
    """
    unknown = set() if places is None else ROOM_WORDS - set(map(normalised, places))

    def listed(names: Iterable[str], last: str) -> str:
        later = dict.fromkeys(unknown, " (as soon as one is known)")
        definite = {each: f"the {each}" for each in ROOM_WORDS}
        return f" {last} ".join(definite.get(each, each) + later.get(each, "") for each in names)

    said = []
    for each in sentences:
        detail = each.detail
        names = " or ".join(map(indefinite, names_of(each, stands_for)))
        told = f" (probably {names})" if names else ""  # an encoder's guess
        parts = [f"{detail.colour} {_bare(each.name)}".strip() + told]
        for relation in detail.relations:
            near = relation.kind is RelationKind.NEXT_TO
            words = f"within {NEXT_TO_M:g} m of" if near else relation.kind.words
            parts.append(f"{words} {' and '.join(map(indefinite, relation.anchors))}")
        where = [f"in {listed(detail.inside, 'or')}"] if detail.inside else []
        where += [f"not in {listed(detail.outside, 'or')}"] if detail.outside else []
        if detail.negatives:
            parts.append(f"not {' or '.join(map(indefinite, detail.negatives))}")
        said.append(", ".join([*parts, *(where or ["anywhere"])]))
    out = dict.fromkeys(place for each in sentences for place in each.stay_out)
    return "; ".join(said) + (f", staying out of {listed(out, 'and')}" if out else "")
