"""Whatever perception does not answer becomes a refusal that a handler may pass on."""

from __future__ import annotations

import threading

import pytest

from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import TextEmbeddings, TextRequest
from onemap_shared.text_embedding import embed_texts
from onemap_shared.transport import RequestRejected
from tests.shared.samples import SAMPLES

EMBEDDINGS = next(each for each in SAMPLES if isinstance(each, TextEmbeddings))


def test_nobody_there_a_refusal_and_silence_are_told_apart() -> None:
    router = MemoryRouter()
    caller, perception = router.bus(), router.bus("perception")
    with pytest.raises(RequestRejected, match="does not run") as missing:
        embed_texts(caller, ("sofa",))
    assert missing.value.code == "perception_missing"
    released = threading.Event()

    def answer(request: TextRequest) -> TextEmbeddings:
        if request.texts == ("flurb",):
            raise RequestRejected("unknown_word", "who knows", {"words": ["flurb"]})
        if request.texts == ("slow",):
            released.wait(20.0)
        return EMBEDDINGS

    perception.serve(keys.EMBED_TEXT, answer)
    assert embed_texts(caller, ("sofa",)).texts == EMBEDDINGS.texts
    with pytest.raises(RequestRejected, match="who knows") as unknown:
        embed_texts(caller, ("flurb",))
    assert (unknown.value.code, unknown.value.details) == ("unknown_word", {"words": ["flurb"]})
    with pytest.raises(RequestRejected, match="in time") as silent:
        embed_texts(caller, ("slow",), timeout_s=0.01)
    assert silent.value.code == "perception_silent"
    released.set()
