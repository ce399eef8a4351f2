"""Similarity of each observed cell to a text.

The cosine of text and cell feature becomes a score as the encoder's calibration defines: the
probability of the text against the neutral words that compete with it, or (1 + cosine) / 2 for an
encoder without calibration. What the competing words weigh in a cell, the logarithm of the sum of
their exponentials, does not depend on the text: it is computed once for each change of a cell, and
kept for each set of competing words.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import torch
from cachetools import LRUCache
from torch import Tensor

from onemap_mapper.belief.cells import CellStore
from onemap_mapper.belief.features import NOTHING_KNOWN, FeatureTable, SlotValues
from onemap_shared.geometry import F32, I64, U8
from onemap_shared.messages import RANKS, TextEmbeddings

CellFeatures: TypeAlias = CellStore | FeatureTable  # of which scores are computed

LEAST_NORM = 1e-12  # shorter features have no direction: their cosines are 0
MAX_SETS = 32  # of competing words: most texts of an encoder share one; 4 bytes per cell each


class NeutralSums:
    """log(sum(exp(temperature cosine))) (count,) float32 of all slots of one map, per set of words.

    words (m, D) float32 unit rows: all that may compete.
    """

    def __init__(self, words: Tensor, temperature: float) -> None:
        self.words, self.temperature = words, temperature
        self._sums: LRUCache[bytes, tuple[Tensor, SlotValues]] = LRUCache(MAX_SETS)  # with excluded
        self._revision, self._count = -1, 0

    def fits(self, words: Tensor, temperature: float) -> bool:
        """Whether these sums are those of these words at this temperature."""
        return self.temperature == temperature and torch.equal(self.words, words)

    def known(self, excluded: Tensor) -> tuple[int, int]:
        """Of which revision, and of how many first slots, there are sums; -1 and 0: of none."""
        kept = _key(excluded) in self._sums
        return (self._revision, self._count) if kept else NOTHING_KNOWN

    def of(self, store: CellFeatures, revision: int, excluded: Tensor) -> Tensor:
        """The sums at this revision of the map; only changed cells are computed again.

        They are valid until the next call.
        excluded (m,): 0 for words that compete, -inf for those that do not.
        """
        if revision != self._revision or store.count != self._count:
            self._update(store)
            self._revision, self._count = revision, store.count
        key = _key(excluded)
        if key not in self._sums:
            sums = SlotValues(1, self.words.device)
            sums.resize(store.count)
            self._fill({key: (excluded, sums)}, store, np.arange(store.count))
            self._sums[key] = (excluded, sums)
        return self._sums[key][1].values[0]

    def _update(self, store: CellFeatures) -> None:
        """Follow the map: grow or shrink with it, and compute what changed."""
        if not self._sums:
            return
        stale = store.changed_since(self._revision, self._count)
        for _, sums in self._sums.values():
            sums.resize(store.count)
        self._fill(self._sums, store, stale)

    def _fill(
        self, sets: Mapping[bytes, tuple[Tensor, SlotValues]], store: CellFeatures, slots: I64
    ) -> None:
        for chosen, features in store.chunks(slots):
            weighed = self.temperature * unit_cosines(features, self.words)
            index = torch.from_numpy(slots[chosen]).to(weighed.device)
            for excluded, sums in sets.values():
                sums.values[0, index] = torch.logsumexp(weighed + excluded, dim=1)


def _key(excluded: Tensor) -> bytes:
    return excluded.cpu().numpy().tobytes()


def unit_cosines(features: Tensor, words: Tensor) -> Tensor:
    """Cosines (n, m) of cell features (n, D) of any length with unit rows (m, D)."""
    norms = torch.linalg.vector_norm(features, dim=1, keepdim=True)
    cosine: Tensor = features @ words.T / norms.clamp(min=LEAST_NORM)
    return cosine


def shares(own: Tensor, sums: Tensor, temperature: float) -> Tensor:
    """Softmax shares (n,) of a text's cosines (n,) against the sums (n,) of competing words."""
    share: Tensor = torch.sigmoid(temperature * own - sums)
    return share


MAX_TEXTS = 32  # whose scores are kept; 2 MB each for a map of 250,000 cells
RANKED_CELLS = 4096  # a rank among so many is right to a percent or two


@dataclass(frozen=True, slots=True)
class TextQuery:
    """One embedded text. concepts (1 + m, D) float32 unit rows: the text, then competing words.

    neutral (M, D): all words that may compete; excluded (M,): 0 for those m, -inf for the others.
    Both are None if the query does not say.
    min_score: a best score below this means that the map holds no such thing, 0 = not calibrated.
    """

    text: str
    concepts: Tensor
    temperature: float
    min_score: float = 0.0
    neutral: Tensor | None = None
    excluded: Tensor | None = None

    @property
    def calibrated(self) -> bool:
        return len(self.concepts) > 1

    def scores_as(self, other: TextQuery) -> bool:
        """Whether both give every cell the same score: robots of one map embed a text each for
        itself."""
        if self is other:
            return True
        if (self.text, self.temperature) != (other.text, other.temperature):
            return False
        ours, theirs = ((query.concepts, query.neutral, query.excluded) for query in (self, other))
        return all(_same(a, b) for a, b in zip(ours, theirs, strict=True))


def _same(a: Tensor | None, b: Tensor | None) -> bool:
    return a is b if a is None or b is None else torch.equal(a, b)


def text_query(embeddings: TextEmbeddings, index: int, device: torch.device) -> TextQuery:
    """The query of one of the texts of a reply from perception."""
    competing = embeddings.neutral[embeddings.neutral_mask[index] > 0]
    concepts = np.concatenate([embeddings.embeddings[index : index + 1], competing])
    return TextQuery(
        embeddings.texts[index],
        torch.from_numpy(concepts).to(device),
        embeddings.temperature,
        embeddings.floor,
        torch.tensor(embeddings.neutral, device=device),
        torch.tensor(np.where(embeddings.neutral_mask[index] > 0, 0.0, -np.inf)).float().to(device),
    )


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


def rank_limits(values: F32) -> F32:
    """Limits (RANKS - 1,) float32, ascending, between the ranks of values (n,): see ``ranked``.

    A value's rank is a function of how many of the sample lie below it; each limit is the highest
    sample below which it does not exceed a rank.
    """
    ordered = np.sort(values[:: max(1, values.size // RANKED_CELLS)])
    below = np.arange(len(ordered) + 1)
    rank = (1 + np.minimum(below / max(len(ordered) - 1, 1), 1.0) * 254).astype(np.uint8)
    needed = np.searchsorted(rank, np.arange(2, RANKS + 1))  # samples below a value of this rank
    limits: F32 = np.append(ordered, np.float32(np.inf))[needed - 1]
    return limits


@dataclass(frozen=True, slots=True)
class CellScores:
    """Scores and cosines, (count,) float32 each, of one query at a revision of the map."""

    query: TextQuery
    revision: int
    scores: F32
    cosines: F32


class KeptScores:
    """The scores and cosines of one query, kept up to date.

    serial: of the query among all that a cache was asked for; another one begins anew.
    """

    def __init__(self, query: TextQuery, serial: int) -> None:
        self.query, self.serial = query, serial
        self.values = SlotValues(2, torch.device("cpu"))

    @property
    def scores(self) -> F32:
        """Scores (count,), not copied: valid until the next update."""
        values: F32 = self.values.values[0].numpy()
        return values

    @property
    def cosines(self) -> F32:
        """Cosines (count,), not copied: valid until the next update."""
        values: F32 = self.values.values[1].numpy()
        return values

    def copied(self) -> CellScores:
        """Scores and cosines that no update changes."""
        revision = self.values.revision
        return CellScores(self.query, revision, self.scores.copy(), self.cosines.copy())


class ScoreCache:
    """Scores of one map for the most recent texts; only changed cells are computed again.

    Not thread-safe. The map may change while scores are computed, if they are computed again at a
    later revision before they are used: what changed meanwhile is computed anew then.
    """

    def __init__(self) -> None:
        self._entries: LRUCache[str, KeptScores] = LRUCache(MAX_TEXTS)
        self._serial = 0  # of the newest query
        self._neutral: NeutralSums | None = None
        self._lengths: SlotValues | None = None  # of the features of all slots

    def scores_of_all(
        self, queries: Sequence[TextQuery], store: CellFeatures, revision: int
    ) -> list[CellScores]:
        """Scores and cosines for each query; those that were asked for together read the map once.

        At most ``MAX_TEXTS`` of them are kept.
        """
        return [kept.copied() for kept in self.updated(queries, store, revision)]

    def updated(
        self, queries: Sequence[TextQuery], store: CellFeatures, revision: int
    ) -> list[KeptScores]:
        """As ``scores_of_all``, but not copied: valid until the next call."""
        found = [self._entry(query) for query in queries]
        for known, group in self._groups(queries).items():
            self._update([found[k] for k in group], store, revision, known)
        return found

    def serials(self, queries: Sequence[TextQuery]) -> tuple[int, ...]:
        """Of the kept scores of the queries, 0 for none: the same as long as they are updated."""
        return tuple(kept.serial if kept else 0 for kept in map(self._kept, queries))

    def _kept(self, query: TextQuery) -> KeptScores | None:
        kept = self._entries.get(query.text)
        return kept if kept is not None and kept.query.scores_as(query) else None

    def _entry(self, query: TextQuery) -> KeptScores:
        kept = self._kept(query)
        if kept is None:
            self._serial += 1
            kept = KeptScores(query, self._serial)
        self._entries[query.text] = kept
        return kept

    def stale(self, queries: Sequence[TextQuery], store: CellFeatures) -> I64:
        """Ascending slots (n,) whose features scores of the queries, at present, would read."""
        lengths = self._lengths.known if self._lengths else NOTHING_KNOWN
        states = {lengths} if queries else set()
        for known, group in self._groups(queries).items():
            states.add(known)
            if len(store.changed_since(*known)):
                states |= {self._sums_known(queries[k]) for k in group if queries[k].calibrated}
        if not states:
            return np.zeros(0, np.int64)
        revisions, counts = zip(*states, strict=True)
        return store.changed_since(min(revisions), min(counts))

    def _sums_known(self, query: TextQuery) -> tuple[int, int]:
        """Of which revision, and of how many first slots, its competing words are summed."""
        words, excluded = _competing(query)
        if self._neutral is None or not self._neutral.fits(words, query.temperature):
            return NOTHING_KNOWN
        return self._neutral.known(excluded)

    def _groups(self, queries: Sequence[TextQuery]) -> dict[tuple[int, int], list[int]]:
        """Indices of the queries by the revision and the number of cells of their kept scores."""
        groups: dict[tuple[int, int], list[int]] = {}
        for k, kept in enumerate(map(self._kept, queries)):
            groups.setdefault(kept.values.known if kept else NOTHING_KNOWN, []).append(k)
        return groups

    def _update(
        self,
        entries: Sequence[KeptScores],
        store: CellFeatures,
        revision: int,
        known: tuple[int, int],
    ) -> None:
        """Compute the scores of the cells that changed since what is known of all these entries."""
        slots = store.changed_since(*known)
        # A slice where all are computed: picking 250,000 by index takes as long as scoring them.
        place: I64 | slice = slice(None) if len(slots) == store.count else slots
        where = place if isinstance(place, slice) else torch.from_numpy(place).to(store.device)
        texts = torch.stack([entry.query.concepts[0] for entry in entries])
        cosine = store.products(slots, texts)
        cosine /= self._lengths_of(store, revision)[where]  # in place: 32 MB for 32 texts
        for entry, own in zip(entries, cosine, strict=True):
            query = entry.query
            if query.calibrated and len(slots):
                sums = self._sums(query, store, revision)[where]
                values = shares(own, sums, query.temperature)
            else:
                values = scores_of(own[:, None], query)
            entry.values.resize(store.count)
            entry.scores[place], entry.cosines[place] = values.cpu().numpy(), own.cpu().numpy()
            entry.values.revision = revision

    def _lengths_of(self, store: CellFeatures, revision: int) -> Tensor:
        """Lengths (count,) of the features, at least ``LEAST_NORM``; changed ones are computed."""
        lengths = self._lengths = self._lengths or SlotValues(1, store.device)
        if (revision, store.count) != lengths.known:
            stale = store.changed_since(*lengths.known)
            lengths.resize(store.count)
            for chosen, features in store.chunks(stale):
                index = torch.from_numpy(stale[chosen]).to(store.device)
                norms = torch.linalg.vector_norm(features, dim=1)
                lengths.values[0, index] = norms.clamp(min=LEAST_NORM)
            lengths.revision = revision
        return lengths.values[0]

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
