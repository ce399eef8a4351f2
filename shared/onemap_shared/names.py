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
