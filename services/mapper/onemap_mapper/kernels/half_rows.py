"""Rows of a float16 table: products and fusion; values are converted in registers, not copied."""

from __future__ import annotations

from typing import Any

import numpy as np

from onemap_mapper.kernels.jit import AVAILABLE, compiled, compiled_fast
from onemap_shared.geometry import F32, I64, U16


def _processor_converts() -> bool:
    """Whether the processor converts float16 itself: on x86 all since 2012, and all of ARM's."""
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    return bool(features.get("f16c", True))  # named for x86 only


def _from_half() -> Any:
    """A function for compiled code: the 16 bits of a float16 to their float32 value."""
    from llvmlite import ir
    from numba import types
    from numba.core import extending

    def half_value(_context: Any, bits: Any) -> Any:  # noqa: ARG001 (numba passes it by name)
        def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            half = builder.bitcast(arguments[0], ir.HalfType())
            return builder.fpext(half, ir.FloatType())

        return types.float32(types.uint16), generate

    return extending.intrinsic(half_value)


def _to_half() -> Any:
    """A function for compiled code: a float32 and what is added to its bits, to a float16's bits.

    The bits of the mantissa that a float16 does not have are cut off then.
    """
    from llvmlite import ir
    from numba import types
    from numba.core import extending

    def cut_half(_context: Any, value: Any, added: Any) -> Any:  # noqa: ARG001
        def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            word = ir.IntType(32)
            bits = builder.add(builder.bitcast(arguments[0], word), arguments[1])
            cut = builder.and_(bits, ir.Constant(word, -(1 << 13)))
            half = builder.fptrunc(builder.bitcast(cut, ir.FloatType()), ir.HalfType())
            return builder.bitcast(half, ir.IntType(16))

        return types.uint16(types.float32, types.uint32), generate

    return extending.intrinsic(cut_half)


HALF = AVAILABLE and _processor_converts()  # whether the functions below can be used
_half_value: Any = _from_half() if AVAILABLE else None
_cut_half: Any = _to_half() if AVAILABLE else None


@compiled_fast
def half_products(table_bits: U16, vector: F32, out: F32) -> None:  # pragma: no cover
    """out (n,) = table (n, D) times vector (D,) float32; table_bits: the float16 table's bits."""
    for k in range(len(out)):
        row = table_bits[k]
        total = np.float32(0)
        for channel in range(len(vector)):
            total += _half_value(row[channel]) * vector[channel]
        out[k] = total


@compiled
def fuse_half_rows(
    table_bits: U16, rows: I64, moves: tuple[F32, I64, F32, I64]
) -> None:  # pragma: no cover
    """Move table[rows[k]] (., D) as ``fuse_rows``, rounded as ``stochastic_rounding.rounded``.

    table_bits: the float16 table's bits. moves: features (n, D), chosen (k,), K (n,), seed (n,).
    """
    features, chosen, K, seed = moves
    for k in range(len(rows)):
        share = K[chosen[k]]
        row, new = table_bits[rows[k]], features[chosen[k]]
        start = np.uint32(seed[chosen[k]])
        near, rest = share < np.float32(0.5), np.float32(1) - share
        for channel in range(len(row)):
            old = _half_value(row[channel])
            step = new[channel] - old
            mean = old + share * step if near else new[channel] - rest * step
            number = np.uint32(start + np.uint32(channel) * np.uint32(0x9E3779B9))
            number = np.uint32((number ^ (number >> np.uint32(16))) * np.uint32(0x7FEB352D))
            number = np.uint32((number ^ (number >> np.uint32(15))) * np.uint32(0x846CA68B))
            number = np.uint32(number ^ (number >> np.uint32(16)))
            row[channel] = _cut_half(mean, number >> np.uint32(19))
