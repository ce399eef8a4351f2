"""Requests embeddings of texts and images from perception, the only service with an encoder."""
# Talks: a call on the bus.

from __future__ import annotations

from typing import TypeVar

from onemap_shared.keys import EMBED_IMAGE, EMBED_TEXT, Procedure
from onemap_shared.messages import ImageRequest, TextEmbeddings, TextRequest
from onemap_shared.transport import (
    CALL_TIMEOUT_S,
    Bus,
    CallError,
    NoReply,
    RemoteError,
    RequestRejected,
)

Q = TypeVar("Q")


def embed_texts(
    bus: Bus, texts: tuple[str, ...], timeout_s: float = CALL_TIMEOUT_S
) -> TextEmbeddings:
    """The embeddings of the texts, or ``RequestRejected`` as a handler may pass it on.

    Its code is perception's own (``unknown_word``), ``perception_missing`` where none
    runs, or ``perception_silent`` where no answer came in time.
    """
    return _asked(bus, EMBED_TEXT, TextRequest(texts), timeout_s, what="words")


def embed_image(bus: Bus, image: bytes, timeout_s: float = CALL_TIMEOUT_S) -> TextEmbeddings:
    """The embedding of a PNG or JPEG, or ``RequestRejected``, with codes as above.

    Perception's own is ``bad_image``.
    """
    return _asked(bus, EMBED_IMAGE, ImageRequest(image), timeout_s, what="images")


def _asked(
    bus: Bus, procedure: Procedure[Q, TextEmbeddings], request: Q, timeout_s: float, *, what: str
) -> TextEmbeddings:
    try:
        return bus.call(procedure, request, timeout_s)
    except RemoteError as problem:
        raise RequestRejected(problem.code, str(problem), problem.details) from problem
    except NoReply as problem:
        raise RequestRejected(
            "perception_missing", f"perception does not run, so {what} cannot be looked up"
        ) from problem
    except CallError as problem:
        raise RequestRejected(
            "perception_silent", f"perception did not look the {what} up in time: try again"
        ) from problem
