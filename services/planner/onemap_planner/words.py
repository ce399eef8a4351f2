"""Words of a search that the encoder cannot place, and what is said about them."""

from __future__ import annotations

from collections.abc import Mapping

from onemap_shared.messages import TextEmbeddings


def unplaced(embeddings: TextEmbeddings) -> dict[str, tuple[str, ...]]:
    """The texts that the encoder cannot place, each with the known words nearest to it."""
    pairs = zip(embeddings.texts, embeddings.nearest, strict=False)  # no pairs: it places all
    return {text: near for text, near in pairs if near}


def sentence(words: Mapping[str, tuple[str, ...]]) -> str:
    """Why a search for these words, at least one, would find nothing."""
    named = ", ".join(
        f"{word!r} (did you mean {' or '.join(map(repr, near))}?)" for word, near in words.items()
    )
    are = "is" if len(words) == 1 else "are"
    return f"{named} {are} like nothing that the encoder was trained to see"


def details(words: Mapping[str, tuple[str, ...]]) -> dict[str, object]:
    """The same for programs."""
    return {"words": [{"word": word, "did_you_mean": list(near)} for word, near in words.items()]}
