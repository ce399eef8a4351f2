"""Sentences: what is said of an object, and which words are not understood."""

import json
from pathlib import Path

import pytest

import onemap_perception
from onemap_shared.messages import Detail, Relation, RelationKind
from onemap_shared.sentence import CLAUSES, COLOURS, Sentence, in_words, listed_sentences, parse

PLACES = ("Ada's den", "wash and dry")
NEXT_TO, ON, UNDER, IN, BETWEEN = RelationKind


def thing(
    name: str,
    *relations: tuple[str, ...],
    colour: str = "",
    inside: tuple[str, ...] = (),
    outside: tuple[str, ...] = (),
    negatives: tuple[str, ...] = (),
    stay_out: tuple[str, ...] = (),
) -> Sentence:
    found = tuple(Relation(RelationKind(each[0]), each[1:]) for each in relations)
    return Sentence(name, Detail(colour, found, inside, outside, negatives), stay_out)


UNDERSTOOD = {
    "lamp": thing("lamp"),
    "The  Lamp": thing("The Lamp"),  # a name stays as it is
    "the lamp next to the bed": thing("lamp", (NEXT_TO, "bed")),
    "Lamp, BY a Bed.": thing("Lamp", (NEXT_TO, "Bed")),
    "the red chair": thing("chair", colour="red"),
    "gray cat tree": thing("cat tree", colour="grey"),
    "a mug on top of the table under the lamp": thing("mug", (ON, "table"), (UNDER, "lamp")),
    "lamp between the bed and the wardrobe and in the kitchen": thing(
        "lamp", (BETWEEN, "bed", "wardrobe"), inside=("kitchen",)
    ),
    "key in the box in the kitchen": thing("key", (IN, "box"), inside=("kitchen",)),
    "sink in the kitchen cabinet": thing("sink", (IN, "kitchen cabinet")),
    "cup in the kitchen or the guest bedroom": thing("cup", inside=("kitchen", "guest bedroom")),
    "cup in the kitchen or in the hall": thing("cup", inside=("kitchen", "hall")),
    "cup in ada's den": thing("cup", inside=("Ada's den",)),
    "cup in the attic, but not in the hall and the study": thing(
        "cup", inside=("attic",), outside=("hall", "study")
    ),
    "cup, stay out of the nursery and Ada's Den": thing("cup", stay_out=("nursery", "Ada's den")),
    "cup not in wash and dry": thing("cup", outside=("wash and dry",)),
    # nouns that hold words of the grammar
    "night stand on the rug": thing("night stand", (ON, "rug")),
    "light on the ceiling?": thing("light", (ON, "ceiling")),
    "stand-up desk near a walk-in shower": thing("stand-up desk", (NEXT_TO, "walk-in shower")),
    "red wine": thing("red wine"),
    "red wine bottle in a box": thing("red wine bottle", (IN, "box")),
    "orange": thing("orange"),
    "an orange orange": thing("orange", colour="orange"),
    "box in box spring": thing("box", (IN, "box spring")),
    "bedside table by the bed": thing("bedside table", (NEXT_TO, "bed")),
    "something to sit on": thing("something to sit on"),
    "something to sit on in the kitchen": thing("something to sit on", inside=("kitchen",)),
    # questions and commands
    "Where is the sofa?": thing("the sofa"),
    "could you show me where the red chair is, please": thing("chair", colour="red"),
    "Is there any lamp next to the bed?": thing("lamp", (NEXT_TO, "bed")),
    "go to the bed": thing("the bed"),
    "have you seen a cup that is standing on the table": thing("cup", (ON, "table")),
    "please": thing("please"),
    # what it is not
    "anything to sit on that is not a sofa": thing("anything to sit on", negatives=("sofa",)),
    "a table but no desk or coffee table": thing("table", negatives=("desk", "coffee table")),
    "lamp, neither a ceiling lamp nor a torch, in the hall": thing(
        "lamp", inside=("hall",), negatives=("ceiling lamp", "torch")
    ),
    "a chair that is light blue": thing("chair", colour="blue"),
    "a backpack, the black one, in the hall": thing("backpack", colour="black", inside=("hall",)),
    "lamp, stay away from the hall": thing("lamp", stay_out=("hall",)),
    "sofa, preferably not in the hall": thing("sofa", outside=("hall",)),
    "the vacuum robot": thing("the vacuum robot"),
    "jar of honey": thing("jar of honey"),
}


@pytest.mark.parametrize("text", UNDERSTOOD)
def test_a_sentence_is_understood(text: str) -> None:
    sentence = parse(text, PLACES)
    assert sentence == UNDERSTOOD[text]
    if sentence.name in text:  # what it says of itself means the same
        assert parse(str(sentence), PLACES) == sentence


# the text, the words that the refusal quotes, and what it says of them
REFUSED = {
    "lamp behind the sofa": ("behind the sofa", "on, under, next to, in or between"),
    "lamp in front of the sofa": ("in front of the sofa", "next to"),
    "chair with wheels near the bed": ("with wheels", "next to"),
    "lamp not on the table": ("not on the table", "'not in' a place"),
    "lamp on the table or under the bed": ("or under the bed", "next to"),
    "lamp next to": ("next to", "names nothing"),
    "lamp between the chairs": ("between the chairs", "between the A and the B"),
    "lamp near the red chair": ("near the red chair", "colour"),
    "lamp near the kitchen": ("near the kitchen", "'in' or 'not in'"),
    "lamp near the bed and the table": ("bed and the table", "one thing at a time"),
    "lamp, chair in the kitchen": ("lamp, chair", "one thing at a time"),
    "in the kitchen": ("", "names no object"),
    "1 2 3": ("", "no readable word"),
    "cup on a and on b and on c and on d": ("", "4 relations"),
    "cup on a tray on a table by the bed": ("on a tray on a table by the bed", "joined by 'and'"),
    "a cup or a glass": ("or", "each by itself"),
    "two chairs": ("two", "not how many"),
    "the second chair": ("the second", "not counted"),
    "where are my keys?": ("my", "whose a thing is"),
    "the cup that I left here": ("that I left", "colour"),
    "the biggest plant": ("the biggest", "not compared"),
    "bed and sofa": ("bed and sofa", "one thing at a time"),
    "chair, not a chair": ("not chair", "itself is excluded"),
    "chair, not the red one": ("not red one", "not excluded"),
    "a lamp, a red chair": ("lamp, a red chair", "one thing at a time"),
    "plant in white pot": ("in white pot", "a colour is said only"),
    # what would be taken for its opposite, or for nothing
    "lamp away from the hall": ("away from the hall", "sentence names"),
    "lamp nowhere near the bed": ("nowhere near the bed", "sentence names"),
    "lamp never in the hall": ("never in the hall", "sentence names"),
    "lamp isn't in the hall": ("isn't", "no name"),
    "lamp but skip the hall": ("but", "no name"),
    "sofa (not the loveseat)": ("(not the loveseat)", "brackets"),
    "chair not too close to the table": ("not too", "sentence names"),
    "something to sit on, not near the window": ("not near the window", "sentence names"),
    "it's not in the hall, where is the cup": ("where is the cup", "sentence names"),
    "we are not allowed in the hall, find the cup": ("find", "no name"),
    "a chair but not that": ("that", "a sentence names an object"),
    "something, not a sofa": ("something", "one thing or place"),
    "the corner of the kitchen": ("the corner of", "name the whole"),
    "check under the bed for slippers": ("check", "name the thing"),
    "sofa number 2": ("number", "not counted"),
    "the chair... the red one": ("chair...", "one sentence"),
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_not_understood_is_named(text: str) -> None:
    words, why = REFUSED[text]
    with pytest.raises(ValueError, match=why) as refused:
        parse(text, PLACES)
    assert not words or repr(words) in str(refused.value)


def test_every_name_of_the_vocabulary_is_a_name_and_can_be_described() -> None:
    file = Path(onemap_perception.__file__).parent / "mini" / "vocabulary.json"
    known = json.loads(file.read_text(encoding="utf-8"))
    named = ("aliases", "held_out", "also")
    words = {word for entry in known["classes"] for each in named for word in entry.get(each, ())}
    for word in words | {*known["neutral"], *known["common"]}:
        assert parse(word) == Sentence(word)
        described = parse(f"the blue {word} on a bed not in the hall")
        assert described == thing(word, (ON, "bed"), colour="blue", outside=("hall",))


@pytest.mark.parametrize("text", ["lamp, avoid the hall, the lab", "chair, not a stool, a bench"])
def test_what_follows_an_excluded_thing_and_a_comma_is_not_guessed(text: str) -> None:
    with pytest.raises(ValueError, match="say 'or' between the things of a list, and 'then'"):
        listed_sentences(text)
    assert listed_sentences(text.replace(", the ", " or the ").replace(", a bench", " or a bench"))


def test_parts_say_the_same_as_a_sentence() -> None:
    for part, all_words in CLAUSES.items():
        phrases = {"between": ["a bed", "the desk"], "in": ["box"]}.get(part, ["hall"])
        phrases = ["bed"] if part in ("near", "on", "under", "negatives") else phrases
        for words in all_words:
            sentence = parse(f"lamp {words} {' and '.join(phrases)}")
            assert parse("lamp", parts={part: phrases}) == sentence
    assert parse("lamp near a bed", parts={"colour": ["gray"], "in": ["den"]}, places=["Den"]) == (
        thing("lamp", (NEXT_TO, "bed"), colour="grey", inside=("Den",))
    )
    with pytest.raises(
        ValueError, match=r"'mauve' is not understood: an object has one colour of black"
    ):
        parse("lamp", parts={"colour": ["mauve"]})
    with pytest.raises(ValueError, match=r"'bed in the hall' is not understood"):
        parse("lamp", parts={"near": ["bed in the hall"]})


def test_what_was_understood_is_said_in_words() -> None:
    said = {
        "a lamp": "lamp, anywhere",
        "lamp next to the bed": "lamp, within 1 m of a bed, anywhere",
        "red mug on an armchair in the kitchen": "red mug, on an armchair, in the kitchen "
        "(as soon as one is known)",
        "key between bed and desk, not in the hall, stay out of ada's den, hall": "key, "
        "between a bed and a desk, not in the hall (as soon as one is known), staying out of "
        "Ada's den and the hall (as soon as one is known)",
    }
    for text, words in said.items():
        sentence = parse(text, PLACES)
        assert in_words([sentence], PLACES) == words
    assert in_words([thing("cup", inside=("hall",))]) == "cup, in the hall"


def test_places_that_nobody_knows_are_found_and_rooms_may_become_known() -> None:
    sentence = parse("cup in the kitchen, not in the west room, stay out of the hall", PLACES)
    assert sentence.asks_for_places
    assert sentence.unknown_places(PLACES) == ("west room", "hall")
    assert sentence.unknown_places(["West Room", "hall"]) == ()
    assert parse("cup in a box").asks_for_places  # the map may know a place of this name
    assert not parse("red cup on a box").asks_for_places


def test_colours_mean_those_that_are_checked() -> None:
    assert set(COLOURS.values()) <= set(COLOURS)
