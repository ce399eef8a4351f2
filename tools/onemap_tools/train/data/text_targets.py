"""Class texts as training targets: MiniLM embeddings of every alias."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from onemap_perception.text.text_encoder import EmbedTexts
from onemap_perception.text.vocabulary import Vocabulary


@dataclass(frozen=True, slots=True)
class TextBank:
    """aliases (K, A, D) unit rows, repeated where a class has fewer than A; neutral (M, D)."""

    aliases: Tensor
    neutral: Tensor

    def sample(self, generator: torch.Generator) -> Tensor:
        """One random alias of every class, then the neutral words: (K + M, D)."""
        classes, count, _ = self.aliases.shape
        chosen = torch.randint(count, (classes,), generator=generator)
        return torch.cat([self.aliases[torch.arange(classes), chosen], self.neutral])


def build_text_bank(vocabulary: Vocabulary, embed: EmbedTexts) -> TextBank:
    """Embeddings of all training words, each in the vocabulary's prompt."""

    def rows(words: Sequence[str]) -> Tensor:
        return torch.from_numpy(embed([vocabulary.prompt.format(word) for word in words]))

    longest = max(len(entry.aliases) for entry in vocabulary.classes)
    padded = [
        [entry.aliases[index % len(entry.aliases)] for index in range(longest)]
        for entry in vocabulary.classes
    ]
    return TextBank(
        torch.stack([rows(aliases) for aliases in padded]), rows(list(vocabulary.neutral))
    )
