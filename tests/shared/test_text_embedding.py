"""Whatever perception does not answer becomes a refusal that a handler may pass on."""

from __future__ import annotations

import threading

import pytest

from onemap_shared import keys
from onemap_shared.messages import ImageRequest, TextEmbeddings, TextRequest
from onemap_shared.text_embedding import embed_image, embed_texts
from onemap_shared.transport import RequestRejected
from tests.memory_bus import MemoryRouter
from tests.shared.samples import PNG, SAMPLES

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


def test_an_image_is_embedded_or_refused_with_perceptions_code() -> None:
    router = MemoryRouter()
    caller, perception = router.bus(), router.bus("perception")
    with pytest.raises(RequestRejected, match="so images cannot be looked up") as missing:
        embed_image(caller, PNG)
    assert missing.value.code == "perception_missing"
    asked: list[bytes] = []

    def answer(request: ImageRequest) -> TextEmbeddings:
        asked.append(request.image)
        if len(asked) > 1:
            raise RequestRejected("bad_image", "cut off")
        return EMBEDDINGS

    perception.serve(keys.EMBED_IMAGE, answer)
    assert embed_image(caller, PNG).texts == EMBEDDINGS.texts
    assert asked == [PNG]
    with pytest.raises(RequestRejected, match="cut off") as refused:
        embed_image(caller, PNG)
    assert refused.value.code == "bad_image"
