"""Similarity of each observed cell to a text.

The cosine of text and cell feature becomes a score as the encoder's calibration defines: the
probability of the text against the neutral words that compete with it, or (1 + cosine) / 2 for
an encoder without calibration.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from cachetools import LRUCache
from torch import Tensor

from onemap_mapper.feature_table import CellFeatures
from onemap_mapper.neutral_cosines import (
    LEAST_NORM,
    NOTHING_KNOWN,
    NeutralSums,
    shares,
    stale_slots,
    unit_cosines,
)
from onemap_shared.geometry import F32, I64, U8
from onemap_shared.messages import TextEmbeddings

MAX_TEXTS = 32  # whose scores are kept; 2 MB each for a map of 250,000 cells
RANKED_CELLS = 4096  # a rank among so many is right to a percent or two


@dataclass(frozen=True, slots=True)
class TextQuery:
    """One embedded text. concepts (1 + m, D) float32 unit rows: the text, then competing words.

    neutral (M, D): all words that may compete; excluded (M,): 0 for those m, -inf for the others.
    Both are None if the query does not say.
    min_score: a best score below this means that the map holds no such thing, 0 = not calibrated;
    nearest: words of the encoder next to a text that it does not contain.
    """

    text: str
    concepts: Tensor
    temperature: float
    min_score: float = 0.0
    nearest: tuple[str, ...] = ()
    neutral: Tensor | None = None
    excluded: Tensor | None = None

    @property
    def calibrated(self) -> bool:
        """Whether scores are probabilities."""
        return len(self.concepts) > 1


def text_query(embeddings: TextEmbeddings, index: int, device: torch.device) -> TextQuery:
    """The query of one of the texts of a reply from perception."""
    competing = embeddings.neutral[embeddings.neutral_mask[index] > 0]
    concepts = np.concatenate([embeddings.embeddings[index : index + 1], competing])
    return TextQuery(
        embeddings.texts[index],
        torch.from_numpy(concepts).to(device),
        embeddings.temperature,
        embeddings.floor,
        embeddings.nearest[index] if embeddings.nearest else (),
        torch.tensor(embeddings.neutral, device=device),
        torch.tensor(np.where(embeddings.neutral_mask[index] > 0, 0.0, -np.inf)).float().to(device),
    )


def scores(features: Tensor, query: TextQuery) -> Tensor:
    """Scores (n,) float32 in [0, 1] of cell features (n, D) float32, of any length."""
    return scores_of(cosines(features, query), query)


def cosines(features: Tensor, query: TextQuery) -> Tensor:
    """Cosines (n, 1 + m) of cell features (n, D) with the text and its competing words."""
    return unit_cosines(features, query.concepts)


def scores_of(cosine: Tensor, query: TextQuery) -> Tensor:
    """Scores (n,) float32 of cosines (n, 1 + m)."""
    if not query.calibrated:
        halves: Tensor = (1.0 + cosine[:, 0]) / 2.0
        return halves.clamp(0.0, 1.0)
    shares: Tensor = torch.softmax(query.temperature * cosine, dim=1)[:, 0]
    return shares


def against(text: CellScores, negatives: Sequence[CellScores]) -> CellScores:
    """The scores of a text where other texts compete with it, besides the neutral words.

    With z the sum of exp(t cos) over the neutral words, a score is s = exp(t c) / (exp(t c) + z),
    so that each negative n adds exp(t (c_n - c)) to 1 / s. Without calibration a cell that is more
    like a negative scores 0.
    """
    values, own = text.scores.astype(np.float64), text.cosines.astype(np.float64)
    if not text.query.calibrated:
        rival = np.max([other.cosines for other in negatives], axis=0, initial=-np.inf)
        return replace(text, scores=np.where(rival > own, 0.0, values).astype(np.float32))
    with np.errstate(divide="ignore", over="ignore"):
        odds = 1.0 / values
        for other in negatives:
            odds += np.exp(text.query.temperature * (other.cosines - own))
        return replace(text, scores=(1.0 / odds).astype(np.float32))


def ranks(values: F32) -> U8:
    """Rank (n,) of each value among all: 1 for the lowest, 255 for the highest; ties are equal.

    What a score cannot tell where it is 0 almost everywhere, its rank can: which of the cells
    that do not show the object are most like it.
    """
    if values.size == 0:
        return np.zeros(0, np.uint8)
    ordered = np.sort(values[:: max(1, values.size // RANKED_CELLS)])
    below = np.searchsorted(ordered, values, side="left")
    share = below / max(len(ordered) - 1, 1)
    return (1 + np.minimum(share, 1.0) * 254).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class CellScores:
    """Scores and cosines, (count,) float32 each, of one query at a revision of the map."""

    query: TextQuery
    revision: int
    scores: F32
    cosines: F32


class ScoreCache:
    """Scores of one map for the most recent texts; only changed cells are computed again.

    Not thread-safe. The map may change while scores are computed, if they are computed again at a
    later revision before they are used: what changed meanwhile is computed anew then.
    """

    def __init__(self) -> None:
        self._entries: LRUCache[str, CellScores] = LRUCache(MAX_TEXTS)
        self._neutral: NeutralSums | None = None
        self._norms = SlotNorms()

    def scores(self, query: TextQuery, store: CellFeatures, revision: int) -> F32:
        """Scores (count,) float32 of all slots at this revision of the map."""
        return self.cell_scores(query, store, revision).scores

    def cell_scores(self, query: TextQuery, store: CellFeatures, revision: int) -> CellScores:
        """Scores and cosines of all slots at this revision of the map."""
        return self.scores_of_all([query], store, revision)[0]

    def scores_of_all(
        self, queries: Sequence[TextQuery], store: CellFeatures, revision: int
    ) -> list[CellScores]:
        """Scores and cosines for each query; those that were asked for together read the map once.

        At most ``MAX_TEXTS`` of them are kept.
        """
        found: dict[int, CellScores] = {}
        for known, group in self._groups(queries).items():
            chosen = [queries[k] for k in group]
            found |= dict(zip(group, self._updated(chosen, store, revision, known), strict=True))
        for k, query in enumerate(queries):
            self._entries[query.text] = found[k]
        return [found[k] for k in range(len(queries))]

    def stale(self, queries: Sequence[TextQuery], store: CellFeatures) -> I64:
        """Ascending slots (n,) whose features scores of the queries, at present, would read."""
        states = {self._norms.known} if queries else set()
        for known, group in self._groups(queries).items():
            states.add(known)
            if len(stale_slots(store, *known)):
                states |= {self._sums_known(queries[k]) for k in group if queries[k].calibrated}
        if not states:
            return np.zeros(0, np.int64)
        revisions, counts = zip(*states, strict=True)
        return stale_slots(store, min(revisions), min(counts))

    def _sums_known(self, query: TextQuery) -> tuple[int, int]:
        """As ``_known``, of the sums of its competing words."""
        words, excluded = _competing(query)
        if self._neutral is None or not self._neutral.fits(words, query.temperature):
            return NOTHING_KNOWN
        return self._neutral.known(excluded)

    def _known(self, query: TextQuery) -> tuple[int, int]:
        """Of which revision, and of how many first slots, the query's scores are kept."""
        kept = self._entries.get(query.text)
        if kept is None or kept.query is not query:
            return NOTHING_KNOWN
        return kept.revision, len(kept.scores)

    def _groups(self, queries: Sequence[TextQuery]) -> dict[tuple[int, int], list[int]]:
        """Indices of the queries by the revision and the number of cells of their kept scores."""
        groups: dict[tuple[int, int], list[int]] = {}
        for k, query in enumerate(queries):
            groups.setdefault(self._known(query), []).append(k)
        return groups

    def _updated(
        self,
        queries: Sequence[TextQuery],
        store: CellFeatures,
        revision: int,
        known: tuple[int, int],
    ) -> list[CellScores]:
        """The queries' scores, computed where the map changed since what is known of them."""
        kept = min(known[1], store.count)  # a corrected map may have fewer cells
        slots = stale_slots(store, known[0], kept)
        # A slice where all are computed: picking 250,000 by index takes as long as scoring them.
        place: I64 | slice = slice(None) if len(slots) == store.count else slots
        where = place if isinstance(place, slice) else torch.from_numpy(place).to(store.device)
        texts = torch.stack([query.concepts[0] for query in queries])
        cosine = store.products(slots, texts)
        cosine /= self._norms.of(store, revision)[where]  # in place: 32 MB for 32 texts
        made = []
        for query, own in zip(queries, cosine, strict=True):
            if query.calibrated and len(slots):
                sums = self._sums(query, store, revision)[where]
                values = shares(own, sums, query.temperature)
            else:
                values = scores_of(own[:, None], query)
            found = CellScores(query, revision, values.cpu().numpy(), own.cpu().numpy().copy())
            if not isinstance(place, slice):
                found = self._entered(found, slots, store.count, kept)
            made.append(found)
        return made

    def _entered(self, found: CellScores, slots: I64, count: int, kept: int) -> CellScores:
        """What was found for some slots (n,), entered into what is kept of the first ones."""
        both = np.zeros((2, count), np.float32)
        if kept:
            entry = self._entries[found.query.text]
            both[0, :kept], both[1, :kept] = entry.scores[:kept], entry.cosines[:kept]
        both[0, slots], both[1, slots] = found.scores, found.cosines
        return replace(found, scores=both[0], cosines=both[1])

    def _sums(self, query: TextQuery, store: CellFeatures, revision: int) -> Tensor:
        """What the words that compete with a text weigh in each cell (count,)."""
        words, excluded = _competing(query)
        if self._neutral is None or not self._neutral.fits(words, query.temperature):
            self._neutral = NeutralSums(words, query.temperature)
        return self._neutral.of(store, revision, excluded)


def _competing(query: TextQuery) -> tuple[Tensor, Tensor]:
    """The words that may compete with a text, and which of them do not, as in ``TextQuery``."""
    if query.neutral is None or query.excluded is None:
        words = query.concepts[1:]
        return words, words.new_zeros(len(words))
    return query.neutral, query.excluded


class SlotNorms:
    """Lengths (count,) float32 of the features of all slots of one map, kept up to date."""

    def __init__(self) -> None:
        self._norms = torch.zeros(0)
        self._revision = -1

    @property
    def known(self) -> tuple[int, int]:
        """Of which revision, and of how many first slots, the lengths are."""
        return self._revision, len(self._norms)

    def of(self, store: CellFeatures, revision: int) -> Tensor:
        """The lengths at this revision, at least ``LEAST_NORM``; only changed ones are computed."""
        if revision != self._revision or len(self._norms) != store.count:
            kept = min(len(self._norms), store.count)
            stale = stale_slots(store, self._revision, kept)
            norms = torch.zeros(store.count, device=store.device)
            norms[:kept] = self._norms[:kept]
            for chosen, features in store.chunks(stale):
                lengths = torch.linalg.vector_norm(features, dim=1)
                index = torch.from_numpy(stale[chosen]).to(store.device)
                norms[index] = lengths.clamp(min=LEAST_NORM)
            self._norms, self._revision = norms, revision
        return self._norms
