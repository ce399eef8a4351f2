"""Recorded queries, asked of the map that is computed again."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from math import dist

import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery, text_query
from onemap_shared.messages import AnsweredQuery, SimilarityRequest, TextEmbeddings

SCORE_TOLERANCE = 1e-3  # a product's sum may have another order: with more threads, in a batch
PLACE_TOLERANCE_M = 0.01


@dataclass(slots=True)
class AskedAgain:
    """The queries of a recording by the revision of the map that answered them.

    compared, equal: answers that were computed again, and those with the same best score at the
    same place. Queries of texts whose embedding was not recorded are not compared.
    """

    queries: dict[int, list[AnsweredQuery]] = field(default_factory=lambda: defaultdict(list))
    texts: dict[str, TextQuery] = field(default_factory=dict)
    compared: int = 0
    equal: int = 0

    def add(self, query: AnsweredQuery) -> None:
        """A query of the recording."""
        self.queries[query.revision].append(query)

    def embed(self, embeddings: TextEmbeddings) -> None:
        """Embeddings of the recording."""
        device = torch.device("cpu")
        for index, text in enumerate(embeddings.texts):
            self.texts[text] = text_query(embeddings, index, device)

    def ask(self, belief: BeliefMap, params: MapperConfig) -> None:
        """Compare the answers that this map gave, if it is one of the recorded revisions."""
        for query in self.queries.pop(belief.revision, ()):
            if belief.dimension and all(text in self.texts for text in query.texts):
                self.compared += 1
                self.equal += self._same(query, belief, params)

    def _same(self, query: AnsweredQuery, belief: BeliefMap, params: MapperConfig) -> bool:
        request = SimilarityRequest(query.text, negatives=query.negatives, area_m=query.area_m)
        texts = [self.texts[query.text], *self._of(query.negatives)]
        reply = similarity_reply(MapScores(belief).of(texts), request=request, params=params)
        centre_m = tuple(map(float, reply.centres_m[0])) if len(reply.centres_m) else ()
        if abs(reply.best_score - query.best_score) > SCORE_TOLERANCE:
            return False
        if not (centre_m and query.centre_m):
            return centre_m == query.centre_m
        return dist(centre_m, query.centre_m) <= PLACE_TOLERANCE_M

    def _of(self, texts: Iterable[str]) -> list[TextQuery]:
        return [self.texts[text] for text in texts]
