"""Products with the rows of a table, read once; float16 is converted in registers, not copied."""

from __future__ import annotations

from typing import Any

import numpy as np

from onemap_mapper.kernels.jit import AVAILABLE, compiled_fast
from onemap_shared.geometry import F32, U16


def _processor_converts() -> bool:
    """Whether the processor converts float16 itself: on x86 all since 2012, and all of ARM's."""
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    return bool(features.get("f16c", True))  # named for x86 only


def _conversion() -> Any:
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


HALF = AVAILABLE and _processor_converts()  # whether ``half_products`` can be used
_half_value: Any = _conversion() if AVAILABLE else None


@compiled_fast
def half_products(table_bits: U16, vector: F32, out: F32) -> None:  # pragma: no cover
    """out (n,) = table (n, D) times vector (D,) float32; table_bits: the float16 table's bits."""
    for k in range(len(out)):
        row = table_bits[k]
        total = np.float32(0)
        for channel in range(len(vector)):
            total += _half_value(row[channel]) * vector[channel]
        out[k] = total


@compiled_fast
def products(table: F32, vector: F32, out: F32) -> None:  # pragma: no cover
    """out (n,) = table (n, D) float32 times vector (D,) float32."""
    for k in range(len(out)):
        row = table[k]
        total = np.float32(0)
        for channel in range(len(vector)):
            total += row[channel] * vector[channel]
        out[k] = total
