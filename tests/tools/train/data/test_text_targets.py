"""The bank of class texts samples aliases of the right class."""

from __future__ import annotations

import numpy as np
import torch

from onemap_tools.train.data.text_targets import build_text_bank
from tests.tools.train.tiny import VOCABULARY, embed


def test_a_sample_holds_one_alias_of_every_class_and_the_neutral_words() -> None:
    bank = build_text_bank(VOCABULARY, embed)
    assert bank.aliases.shape == (2, 3, 384)
    generator = torch.Generator().manual_seed(0)
    seen = [set[int](), set[int]()]
    for _ in range(50):
        rows = bank.sample(generator).numpy()
        assert rows.shape == (3, 384)
        for index, entry in enumerate(VOCABULARY.classes):
            cosines = embed([f"a {word}" for word in entry.aliases]) @ rows[index]
            assert cosines.max() > 0.999
            seen[index].add(int(cosines.argmax()))
        np.testing.assert_allclose(rows[2], embed(["a car"])[0])
    assert seen == [{0, 1}, {0, 1, 2}]
