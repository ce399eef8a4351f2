"""What this machine can do at most: how fast it copies memory and multiplies matrices."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch

COPY_BYTES = 2**27  # larger than the caches
MATRIX = 1024  # rows and columns
REPEATS = 5


@dataclass(frozen=True, slots=True)
class MachineLimits:
    """copy_gb_s: GB read and written per second; matrix_gflops: float32 operations per ns."""

    copy_gb_s: float
    matrix_gflops: float

    def least_ms(self, *, moved_bytes: float, operations: float) -> float:
        """The time of moving and computing so much, whichever takes longer, in milliseconds."""
        return max(moved_bytes / self.copy_gb_s, operations / self.matrix_gflops) * 1e-6

    def as_dict(self) -> dict[str, Any]:
        """For the report."""
        return {
            "copy_gb_s": round(self.copy_gb_s, 1),
            "matrix_gflops": round(self.matrix_gflops, 1),
        }


def machine_limits(clock: Callable[[], float] = time.perf_counter) -> MachineLimits:
    """Measured now, with torch's present number of threads, the best of several runs."""
    source, target = torch.ones(COPY_BYTES // 4), torch.empty(COPY_BYTES // 4)
    copy_s = best_s(lambda: target.copy_(source), clock=clock)
    a, b = torch.ones((MATRIX, MATRIX)), torch.ones((MATRIX, MATRIX))
    product_s = best_s(lambda: torch.mm(a, b), clock=clock)
    return MachineLimits(2 * COPY_BYTES / copy_s * 1e-9, 2 * MATRIX**3 / product_s * 1e-9)


def best_s(
    run: Callable[[], object],
    repeats: int = REPEATS,
    clock: Callable[[], float] = time.perf_counter,
) -> float:
    """The shortest time in seconds of several runs, after one that does not count."""
    run()
    times = []
    for _ in range(repeats):
        started = clock()
        run()
        times.append(clock() - started)
    return min(times)
