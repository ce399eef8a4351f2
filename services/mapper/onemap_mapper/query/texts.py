"""The queries of texts and images, embedded by perception in the space of the map's features."""
# Talks: asks perception for embeddings.

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import torch
from cachetools import LRUCache
from torch import Tensor

from onemap_mapper.query.similarity import TextQuery, text_query
from onemap_shared.clock import Clock, Future
from onemap_shared.messages import TextEmbeddings
from onemap_shared.text_embedding import embed_image, embed_texts
from onemap_shared.transport import Bus, RequestRejected

MAX_TEXTS = 256  # a few KB each
MAX_BATCH = 64
BATCHES_AT_ONCE = 2  # so that a slow one does not block the others

Entry = tuple[str, TextQuery]  # the text space and the query
Waiting = Mapping[str, "Future[Entry]"]


class TextCache:
    """The most recently used queries by text. Thread-safe.

    Texts that are asked for while others are being embedded wait and travel together.
    """

    def __init__(
        self,
        embed: Callable[[tuple[str, ...]], TextEmbeddings],
        device: torch.device,
        clock: Clock,
    ) -> None:
        self._embed, self._device, self._clock = embed, device, clock
        self._lock = clock.lock()
        self._entries: LRUCache[str, Entry] = LRUCache(MAX_TEXTS)
        self._asked: dict[str, Future[Entry]] = {}  # by text, until there is an answer
        self._waiting: dict[str, Future[Entry]] = {}  # those of them that no batch has taken
        self._clearings = 0
        self._words = torch.zeros((0, 0), device=device)
        self._pool = clock.pool(BATCHES_AT_ONCE, "texts")

    def query(self, text: str) -> Entry:
        """The text space and the query of a text; embeds it without holding the lock."""
        with self._lock:
            entry = self._entries.get(text)
            if entry is not None:
                return entry
            future = self._future(text)
        return future.result()

    def prefetch(self, texts: Iterable[str]) -> None:
        """Begin to embed those that are not there; waits for nobody."""
        with self._lock:
            for text in texts:
                if text not in self._entries:
                    self._future(text)

    def _future(self, text: str) -> Future[Entry]:
        """Of the text's embedding; the caller holds the lock."""
        future = self._asked.get(text)
        if future is None:
            future = self._asked[text] = self._waiting[text] = self._clock.future()
            self._pool.submit(self._run)
        return future

    def kept(self, text: str) -> Entry | None:
        """What ``query`` returns, if it need not be embedded."""
        with self._lock:
            return self._entries.get(text)

    def clear(self) -> None:
        """Drop all entries: the encoder changed."""
        with self._lock:
            self._entries.clear()
            self._clearings += 1

    def _run(self) -> None:
        """Embed the texts that wait; a batch before may have taken them already."""
        with self._lock:
            texts = list(self._waiting)[:MAX_BATCH]
            batch = {text: self._waiting.pop(text) for text in texts}
        if batch:
            self._answer(batch)

    def _answer(self, batch: Waiting) -> None:
        clearings = self._clearings
        try:
            reply = self._embed(tuple(batch))
            words = self._words_of(reply)
            entries = {
                text: (reply.text_space, text_query(reply, index, self._device, words))
                for index, text in enumerate(batch)
            }
        except Exception as problem:  # every asker gets it, none waits for ever
            if len(batch) > 1 and _blames_a_text(problem):
                for text, future in batch.items():
                    self._answer({text: future})
            else:
                self._forget(batch)
                for future in batch.values():
                    future.set_exception(problem)
            return
        with self._lock:
            if clearings == self._clearings:
                self._entries.update(entries)
        self._forget(batch)
        for text, future in batch.items():
            future.set_result(entries[text])

    def _words_of(self, reply: TextEmbeddings) -> Tensor:
        """The neutral words on the device; one copy for all texts of an encoder."""
        words = torch.tensor(reply.neutral, device=self._device)
        if not torch.equal(words, self._words):
            self._words = words
        return self._words

    def _forget(self, batch: Waiting) -> None:
        with self._lock:
            for text in batch:
                del self._asked[text]


def _blames_a_text(problem: Exception) -> bool:
    return isinstance(problem, RequestRejected) and problem.code == "unknown_word"


MAX_IMAGES = 32  # a few KB each, as their scores are kept of so many texts


class MapQueries:
    """Queries for one map. Thread-safe.

    space: the text space of the map and its channels, 0 if it is empty.
    """

    def __init__(
        self, bus: Bus, device: torch.device, space: Callable[[], tuple[str, int]]
    ) -> None:
        self._texts = TextCache(lambda texts: embed_texts(bus, texts), device, bus.clock)
        self._images: LRUCache[str, Entry] = LRUCache(MAX_IMAGES)
        self._lock = bus.clock.lock()
        self._bus, self._device, self._space = bus, device, space

    def clear(self) -> None:
        """Forget all embeddings: the encoder changed."""
        self._texts.clear()
        with self._lock:
            self._images = LRUCache(MAX_IMAGES)

    def of_text(self, text: str) -> TextQuery:
        """The query of a text; rejected if it is embedded in another space than the map."""
        return self._fitting(self._texts.query(text), "texts")

    def of_image(self, image: bytes) -> TextQuery:
        """The query of a PNG or JPEG; rejected as that of a text."""
        name = f"image {hashlib.sha256(image).hexdigest()}"
        with self._lock:
            entry = self._images.get(name)
            images = self._images  # those of the present encoder
        if entry is None:
            made = embed_image(self._bus, image)  # without the lock
            query = replace(text_query(made, 0, self._device), text=name)  # scores are kept by it
            entry = (made.text_space, query)
            with self._lock:
                images[name] = entry
        return self._fitting(entry, "images")

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

    def prefetch(self, names: tuple[str, ...]) -> None:
        """Have the names embedded, for ``kept``."""
        self._texts.prefetch(names)

    def kept(self, names: tuple[str, ...]) -> list[TextQuery]:
        """The queries of those names that were embedded before, for this map; asks nobody."""
        ours = self._space()
        entries = [entry for name in names if (entry := self._texts.kept(name)) is not None]
        return [query for space, query in entries if (space, query.concepts.shape[1]) == ours]

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
