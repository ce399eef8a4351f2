"""Whatever perception does not answer becomes a refusal that a handler may pass on."""

from __future__ import annotations

import pytest

from onemap_shared import keys
from onemap_shared.messages import ImageRequest, TextEmbeddings
from onemap_shared.text_embedding import embed_image
from onemap_shared.transport import RequestRejected
from tests.memory_bus import MemoryRouter
from tests.shared.samples import PNG, SAMPLES

EMBEDDINGS = next(each for each in SAMPLES if isinstance(each, TextEmbeddings))


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
