"""The queries of texts and images, embedded by perception in the space of the map's features."""
# Talks: asks perception for embeddings.

from __future__ import annotations

from collections.abc import Callable

import torch

from onemap_mapper.image_cache import ImageCache
from onemap_mapper.similarity import TextQuery
from onemap_mapper.text_cache import Entry, TextCache
from onemap_shared.text_embedding import embed_image, embed_texts
from onemap_shared.transport import Bus, RequestRejected


class MapQueries:
    """Queries for one map. Thread-safe.

    space: the text space of the map and its channels, 0 if it is empty.
    """

    def __init__(
        self, bus: Bus, device: torch.device, space: Callable[[], tuple[str, int]]
    ) -> None:
        self._texts = TextCache(lambda texts: embed_texts(bus, texts), device)
        self._images = ImageCache(lambda image: embed_image(bus, image), device)
        self._space = space

    def clear(self) -> None:
        """Forget all embeddings: the encoder changed."""
        self._texts.clear()
        self._images.clear()

    def of_text(self, text: str) -> TextQuery:
        """The query of a text; rejected if it is embedded in another space than the map."""
        return self._fitting(self._texts.query(text), "texts")

    def of_image(self, image: bytes) -> TextQuery:
        """The query of a PNG or JPEG; rejected as that of a text."""
        return self._fitting(self._images.query(image), "images")

    def of_rivals(self, names: tuple[str, ...]) -> list[TextQuery]:
        """The queries of the names that the encoder can embed; the others are left out."""
        queries = []
        for name in names:
            try:
                queries.append(self.of_text(name))
            except RequestRejected as problem:
                if problem.code != "unknown_word":
                    raise
        return queries

    def _fitting(self, entry: Entry, what: str) -> TextQuery:
        text_space, query = entry
        ours, dimension = self._space()
        channels = query.concepts.shape[1]
        if dimension and (text_space, channels) != (ours, dimension):
            self.clear()  # perception may come back with the right encoder
            raise RequestRejected(
                "encoder_mismatch",
                f"{what} are embedded in {text_space} ({channels} channels), but the map holds "
                f"{ours} ({dimension} channels): clear the map or restart perception with the "
                "map's encoder",
            )
        return query
