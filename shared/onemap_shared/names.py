"""Names of objects as they are compared: what people type, what scenes and detectors say."""

from __future__ import annotations

ARTICLES = ("a ", "an ", "the ")


def normalised(name: str) -> str:
    """The name without case, leading article and double spaces: "The  Sofa" is "sofa"."""
    plain = " ".join(name.split()).casefold()
    for article in ARTICLES:
        if plain.startswith(article):
            return plain[len(article) :]
    return plain


def same_name(one: str, other: str) -> bool:
    """Whether two names are one: ``normalised`` they are equal."""
    return normalised(one) == normalised(other)


def indefinite(name: str) -> str:
    """A name with "a" or "an"."""
    return f"{'an' if name[:1].lower() in tuple('aeiou') else 'a'} {name}"


DETERMINERS = frozenset(
    {"a", "an", "her", "his", "my", "our", "that", "the", "their", "this", "your"}
    | {"any", "anything", "some", "something", "somewhere"}
)
SINGULAR = ("is", "ss", "us")  # endings of singulars in s


def with_article(name: str) -> str:
    """A name with its article; plurals, and names that have one, as they are."""
    if _determined(name) or (name.endswith("s") and not name.endswith(SINGULAR)):
        return name
    return indefinite(name)


def definite(name: str) -> str:
    """A name with "the", unless it has another such word."""
    return name if _determined(name) else f"the {name}"


def _determined(name: str) -> bool:
    first, last = name.partition(" ")[0].lower(), name.rpartition(" ")[2]
    return first in DETERMINERS or last.isdecimal() or "'s " in name
