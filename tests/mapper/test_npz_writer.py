"""Archives written in parts are those that NumPy writes."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from onemap_mapper.storage.map_file import NpzWriter

ARRAYS: tuple[NDArray, ...] = (
    np.array("text"),
    np.arange(12, dtype=np.int32).reshape(6, 2),
    np.linspace(0, 1, 5, dtype=np.float16),
    np.zeros((0, 7), np.float32),
    np.asfortranarray(np.arange(6, dtype=np.uint8).reshape(2, 3)),
)


def loaded(file: BytesIO) -> Any:
    file.seek(0)
    return np.load(file)


@pytest.mark.parametrize("array", ARRAYS)
def test_an_array_is_read_as_it_was_written(array: NDArray) -> None:
    file = BytesIO()
    with NpzWriter(file) as archive:
        archive.add("one", array)
    np.testing.assert_array_equal(loaded(file)["one"], array, strict=True)


def test_parts_make_up_one_array() -> None:
    file, whole = BytesIO(), np.arange(21.0).reshape(7, 3)
    with NpzWriter(file) as archive:
        archive.add_parts("one", (7, 3), whole.dtype, (whole[k : k + 2] for k in range(0, 7, 2)))
        archive.add("two", whole)
    read = loaded(file)
    for name in ("one", "two"):
        np.testing.assert_array_equal(read[name], whole, strict=True)


@pytest.mark.parametrize(
    ("part", "reason"),
    [
        (np.zeros((6, 3)), "its parts hold 18 values"),
        (np.zeros((7, 3), np.float32), "a part of it is float32"),
    ],
)
def test_parts_of_another_array_are_refused(part: NDArray, reason: str) -> None:
    with pytest.raises(ValueError, match=reason), NpzWriter(BytesIO()) as archive:
        archive.add_parts("one", (7, 3), np.float64, [part])
