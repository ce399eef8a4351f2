"""Similarity of each observed cell to a text.

The cosine of text and cell feature becomes a score as the encoder's calibration defines: the
probability of the text against the neutral words that compete with it, or (1 + cosine) / 2 for an
encoder without calibration. What all words that may compete weigh in a cell, the logarithm of the
sum of their exponentials, does not depend on the text: it is computed once for each change of a
cell. Words that do not compete with a text, its
synonyms, are taken out of that sum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import torch
from cachetools import LRUCache
from torch import Tensor

from onemap_mapper.belief.cells import CellStore
from onemap_mapper.belief.features import NOTHING_KNOWN, FeatureTable, SlotValues
from onemap_mapper.transfers import to_host
from onemap_shared.geometry import F32, I64, U8, Bool
from onemap_shared.messages import RANKS, TextEmbeddings

CellFeatures: TypeAlias = CellStore | FeatureTable  # of which scores are computed

LEAST_NORM = 1e-12  # shorter features have no direction: their cosines are 0
LEAST_REST = 0.05  # of the sum over all words: what it is short of is right to 1e-4
NO_SLOTS: I64 = np.zeros(0, np.int64)
CONTROLS_BELOW = 0.95  # share of the control words whose best score lies below the floor
FLOOR_REVISIONS = 100  # and a map that is not a quarter larger, for which a fitted floor holds
FLOOR_GROWTH = 1.25
TOP_CELLS = 3  # a region's score is the mean of its best cells: one cell alone may be noise


class CellSums:
    """Of all slots of one map, what scores need of a cell whatever the text.

    That are the length of the feature and log(sum(exp(temperature cosine))) over all words that may
    compete, words (m, D) float32 unit rows; m = 0: none. They are computed again for a cell that
    changed when they are asked for.
    """

    def __init__(self, words: Tensor, temperature: float) -> None:
        self.words, self.temperature = words, temperature
        self._held = SlotValues(2, words.device)
        self._stale: Bool = np.zeros(0, bool)
        self._floor, self._fitted_at = 0.0, (0, 0)  # revision and slots

    @property
    def nbytes(self) -> int:
        return self._held.nbytes + self._stale.nbytes

    def fits(self, words: Tensor, temperature: float) -> bool:
        """Whether these sums are those of these words at this temperature."""
        same = self.words is words or torch.equal(self.words, words)
        return same and self.temperature == temperature

    def of(self, store: CellFeatures, revision: int, slots: I64 | slice) -> tuple[Tensor, Tensor]:
        """Lengths (n,), at least ``LEAST_NORM``, and sums (n,) of slots, a slice: of all."""
        self._follow(store, revision)
        if isinstance(slots, slice):
            self._fill(store, np.flatnonzero(self._stale))
            lengths, sums = self._held.values
        else:
            self._fill(store, slots[self._stale[slots]])
            index = torch.from_numpy(slots).to(self.words.device)
            lengths, sums = self._held.values[:, index]
        return lengths, sums

    def _fill(self, store: CellFeatures, slots: I64) -> None:
        """Compute ascending slots."""
        for chosen, features in store.chunks(slots):
            index = torch.from_numpy(slots[chosen]).to(store.device)
            lengths = torch.linalg.vector_norm(features, dim=1).clamp(min=LEAST_NORM)
            self._held.values[0, index] = lengths
            self._held.values[1, index] = self._sum(self.words, features, lengths)
        self._stale[slots] = False

    def floor(self, store: CellFeatures, revision: int, controls: int) -> float:
        """The score that one in twenty of the last ``controls`` words reaches on the map."""
        fitted_at, count = self._fitted_at
        grown = not count or store.count > FLOOR_GROWTH * count
        if grown or revision - fitted_at >= FLOOR_REVISIONS:
            lengths, sums = self.of(store, revision, slice(None))
            cosines = store.products(np.arange(store.count), self.words[-controls:]) / lengths
            scores = torch.exp(self.temperature * cosines - sums)
            best = scores.topk(min(TOP_CELLS, store.count), dim=1).values.mean(dim=1)
            self._floor = float(torch.quantile(best, CONTROLS_BELOW))
            self._fitted_at = revision, store.count
        return self._floor

    def without(
        self, sums: Tensor, cosines: Tensor, excluded: Tensor, store: CellFeatures, slots: I64
    ) -> Tensor:
        """The sums (n,) of these slots without excluded words, by index (k,), cosines (k, n).

        Where the rest is less than ``LEAST_REST`` of the sum, the difference would be rounding:
        these cells are summed anew.
        """
        rest = 1.0 - torch.exp(self.temperature * cosines - sums).sum(dim=0)
        found = sums + torch.log(rest.clamp(min=LEAST_REST))
        few = torch.nonzero(rest < LEAST_REST).squeeze(1)
        kept = torch.ones(len(self.words), dtype=torch.bool, device=self.words.device)
        kept[excluded] = False
        for chosen, features in store.chunks(slots[to_host(few)]):
            lengths = torch.linalg.vector_norm(features, dim=1).clamp(min=LEAST_NORM)
            index = few[torch.from_numpy(chosen).to(few.device)]
            found[index] = self._sum(self.words[kept], features, lengths)
        return found

    def _sum(self, words: Tensor, features: Tensor, lengths: Tensor) -> Tensor:
        """As ``torch.logsumexp`` over the words, a fifth faster; -inf without any."""
        if len(words) == 0:
            return torch.full_like(lengths, -torch.inf)
        weighed = words @ features.T
        weighed *= self.temperature / lengths
        most = weighed.amax(dim=0)
        total: Tensor = weighed.sub_(most).exp_().sum(dim=0).log_().add_(most)
        return total

    def _follow(self, store: CellFeatures, revision: int) -> None:
        """Grow with the map, and note what changed."""
        if (revision, store.count) == self._held.known:
            return
        changed = store.changed_since(*self._held.known)
        self._stale = np.append(self._stale, np.ones(store.count - len(self._stale), bool))
        self._stale[changed] = True
        self._held.resize(store.count)
        self._held.revision = revision


MAX_TEXTS = 32  # whose scores are kept; 2 MB each for a map of 250,000 cells
RANKED_CELLS = 4096  # a rank among so many is right to a percent or two


@dataclass(frozen=True, slots=True)
class TextQuery:
    """One embedded text. concepts (1 + m, D) float32 unit rows: the text, then competing words.

    neutral (M, D): all words that may compete, in the place of those m; excluded (M,): 0 for those
    that do, -inf for the others. Both are None if the query does not say.
    min_score: a best score below this means that the map holds no such thing, 0 = not calibrated.
    controls: see ``TextEmbeddings``; searches go by the order of such scores.
    """

    text: str
    concepts: Tensor
    temperature: float
    min_score: float = 0.0
    neutral: Tensor | None = None
    excluded: Tensor | None = None
    controls: int = 0

    @property
    def calibrated(self) -> bool:
        return len(self.concepts) > 1 or (
            self.excluded is not None and bool((self.excluded == 0).any())
        )

    @property
    def has_probabilities(self) -> bool:
        """Whether labels say what a score is worth."""
        return self.calibrated and not self.controls

    @property
    def fits_floor(self) -> bool:
        return self.controls > 0 and self.min_score == 0

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


def text_query(
    embeddings: TextEmbeddings, index: int, device: torch.device, words: Tensor | None = None
) -> TextQuery:
    """The query of one of the texts of a reply from perception.

    words: its neutral words on the device, which queries may share; None: they are copied there.
    """
    competes = embeddings.neutral_mask[index] > 0
    return TextQuery(
        embeddings.texts[index],
        torch.tensor(embeddings.embeddings[index : index + 1], device=device),
        embeddings.temperature,
        embeddings.floor,
        torch.tensor(embeddings.neutral, device=device) if words is None else words,
        torch.tensor(np.where(competes, 0.0, -np.inf)).float().to(device),
        embeddings.controls,
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
    like a negative scores 0, and has the lowest cosine.
    """
    values, own = text.scores.astype(np.float64), text.cosines.astype(np.float64)
    if not text.query.calibrated:
        rival = np.max([other.cosines for other in negatives], axis=0, initial=-np.inf)
        less = rival > own
        scores = np.where(less, 0.0, values).astype(np.float32)
        return replace(text, scores=scores, cosines=np.where(less, -1.0, own).astype(np.float32))
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


def guiding(found: CellScores | KeptScores) -> F32:
    """By which cells (count,) are ranked for a search: scores are 0 almost everywhere if they are
    probabilities, cosines are not."""
    return found.cosines if found.query.has_probabilities else found.scores


class KeptScores:
    """The scores and cosines of one query, kept up to date.

    serial: of the query among all that a cache was asked for; another one begins anew. excluded
    (k,): words of ``sums``, by index, that do not compete, besides the text itself; is_word:
    whether it is one of them too.
    """

    def __init__(self, query: TextQuery, serial: int, sums: CellSums) -> None:
        self.query, self.serial, self.sums = query, serial, sums
        self.values = SlotValues(2, torch.device("cpu"))
        excluded = torch.nonzero(_competing(query)[1] < 0).squeeze(1)
        own = (sums.words[excluded] == query.concepts[0]).all(dim=1)
        self.excluded, self.is_word = excluded[~own], bool(own.any())

    @property
    def known(self) -> tuple[int, int]:
        """Of which revision of the map, and of how many first slots, they are."""
        return self.values.known

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
        self._sums: CellSums | None = None  # with the words of the newest calibrated text

    @property
    def nbytes(self) -> int:
        """Of the scores that are kept, and of the sums for the next text."""
        scores = sum(kept.values.nbytes for kept in self._entries.values())
        return scores + (self._sums.nbytes if self._sums else 0)

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
        groups: dict[tuple[CellSums, tuple[int, int]], list[KeptScores]] = {}
        for kept in found:
            groups.setdefault((kept.sums, kept.known), []).append(kept)
        for group in groups.values():
            self._update(group, store, revision)
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
            kept = KeptScores(query, self._serial, self.sums_of(query))
        self._entries[query.text] = kept
        return kept

    def sums_of(self, query: TextQuery) -> CellSums:
        """The sums of the words that compete with a text.

        Of a text with which none do, only their lengths count.
        """
        words, _ = _competing(query)
        known = [self._sums] if self._sums else []
        known += [kept.sums for kept in self._entries.values()]
        for sums in known:
            if not query.calibrated or sums.fits(words, query.temperature):
                break
        else:
            sums = CellSums(words, query.temperature)
        if query.calibrated:
            self._sums = sums
        return sums

    def floor(self, query: TextQuery, store: CellFeatures, revision: int) -> float:
        """The text's own ``min_score``, or one that is fitted to the map."""
        if not query.fits_floor:
            return query.min_score
        return self.sums_of(query).floor(store, revision, query.controls)

    def stale(self, queries: Sequence[TextQuery], store: CellFeatures) -> I64:
        """Ascending slots (n,) whose features scores of the queries, at present, would read."""
        states = [kept.known if kept else NOTHING_KNOWN for kept in map(self._kept, queries)]
        if not states:
            return NO_SLOTS
        revisions, counts = zip(*states, strict=True)
        return store.changed_since(min(revisions), min(counts))

    def _update(self, entries: Sequence[KeptScores], store: CellFeatures, revision: int) -> None:
        """Compute the scores of the cells that changed since what is known of these entries.

        It is of the same moment, and the same words may compete with all of them.
        """
        sums, slots = entries[0].sums, store.changed_since(*entries[0].known)
        # A slice where all are computed: picking 250,000 by index takes as long as scoring them.
        place: I64 | slice = slice(None) if len(slots) == store.count else slots
        excluded = torch.unique(torch.cat([entry.excluded for entry in entries]))
        texts = torch.stack([entry.query.concepts[0] for entry in entries])
        cosines = store.products(slots, torch.cat([texts, sums.words[excluded]]))
        lengths, every = sums.of(store, revision, place)
        cosines /= lengths  # in place: 32 MB for 32 texts
        words = cosines[len(entries) :]
        for entry, own in zip(entries, cosines, strict=False):
            competing = every
            if len(entry.excluded):
                rows = torch.searchsorted(excluded, entry.excluded)
                competing = sums.without(every, words[rows], entry.excluded, store, slots)
            if not entry.query.calibrated:
                values = scores_of(own[:, None], entry.query)
            else:  # the sums hold the text itself if it is one of the words
                odds = sums.temperature * own - competing
                values = (torch.exp if entry.is_word else torch.sigmoid)(odds)
            entry.values.resize(store.count)
            entry.scores[place], entry.cosines[place] = values.cpu().numpy(), own.cpu().numpy()
            entry.values.revision = revision


def _competing(query: TextQuery) -> tuple[Tensor, Tensor]:
    """The words that may compete with a text, and which of them do not, as in ``TextQuery``."""
    if query.neutral is None or query.excluded is None:
        words = query.concepts[1:]
        return words, words.new_zeros(len(words))
    return query.neutral, query.excluded
