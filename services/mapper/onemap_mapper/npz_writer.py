"""An .npz archive that is written array by array, as ``numpy.savez`` does it.

An array may come in parts, so that it is never in memory as a whole.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from types import TracebackType
from typing import BinaryIO

import numpy as np
from numpy.typing import DTypeLike, NDArray


class NpzWriter:
    """Writes uncompressed arrays into a file; a context manager that completes the archive."""

    def __init__(self, file: BinaryIO) -> None:
        self._zip = zipfile.ZipFile(file, "w", zipfile.ZIP_STORED)

    def __enter__(self) -> NpzWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._zip.close()

    def add(self, name: str, array: NDArray) -> None:
        """Write a whole array."""
        self.add_parts(name, array.shape, array.dtype, [array])

    def add_parts(
        self, name: str, shape: tuple[int, ...], dtype: DTypeLike, parts: Iterable[NDArray]
    ) -> None:
        """Write an array of this shape from its consecutive parts along the first axis.

        Raises ValueError if they are not exactly that array.
        """
        dtype, written = np.dtype(dtype), 0
        start = {"shape": shape, "fortran_order": False, "descr": dtype.str}
        with self._zip.open(f"{name}.npy", "w", force_zip64=True) as entry:
            np.lib.format.write_array_header_1_0(entry, start)
            for part in parts:
                if part.dtype != dtype:
                    raise ValueError(f"{name} is {dtype}, but a part of it is {part.dtype}")
                entry.write(np.ascontiguousarray(part).data)
                written += part.size
        if written != np.prod(shape, dtype=np.int64):
            raise ValueError(f"{name} is {shape}, but its parts hold {written} values")
