"""Requests text embeddings from perception, the only service with a text encoder."""

from __future__ import annotations

from onemap_shared.keys import EMBED_TEXT
from onemap_shared.messages import TextEmbeddings, TextRequest
from onemap_shared.transport import (
    CALL_TIMEOUT_S,
    Bus,
    CallError,
    NoReply,
    RemoteError,
    RequestRejected,
)


def embed_texts(
    bus: Bus, texts: tuple[str, ...], timeout_s: float = CALL_TIMEOUT_S
) -> TextEmbeddings:
    """The embeddings of the texts, or ``RequestRejected`` as a handler may pass it on.

    Its code is perception's own (``unknown_word``), ``perception_missing`` where none
    runs, or ``perception_silent`` where no answer came in time.
    """
    try:
        return bus.call(EMBED_TEXT, TextRequest(texts), timeout_s)
    except RemoteError as problem:
        raise RequestRejected(problem.code, str(problem), problem.details) from problem
    except NoReply as problem:
        raise RequestRejected(
            "perception_missing", "perception does not run, so words cannot be looked up"
        ) from problem
    except CallError as problem:
        raise RequestRejected(
            "perception_silent", "perception did not look the words up in time: try again"
        ) from problem
