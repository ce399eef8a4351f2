"""What this machine can do at most: how fast it copies memory and multiplies matrices.

Its processor, or the GPU whose figures are wanted.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch

COPY_BYTES = 2**27  # larger than the caches
MATRIX = 1024  # rows and columns
REPEATS = 5
CPU = torch.device("cpu")
Clock = Callable[[], float]  # seconds


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


def wall_clock(device: torch.device) -> Clock:
    """The time at which all is done that was asked of a device: a GPU only takes orders."""
    if device.type != "cuda":
        return time.perf_counter

    def done_s() -> float:
        torch.cuda.synchronize(device)
        return time.perf_counter()

    return done_s


def clock_of(device: torch.device, threads: int) -> Clock:
    """By which a device is measured: the processor's time where one thread computes alone.

    That is the time of a machine that does nothing else.
    """
    alone = device.type == "cpu" and threads == 1
    return time.process_time if alone else wall_clock(device)


def device_facts(device: torch.device) -> dict[str, Any]:
    """Which device was measured; of a GPU its name, and the most memory that tensors took."""
    if device.type != "cuda":
        return {"device": str(device)}
    return {
        "device": str(device),
        "device_name": torch.cuda.get_device_name(device),
        "peak_device_bytes": torch.cuda.max_memory_allocated(device),
    }


def machine_limits(clock: Clock = time.perf_counter, device: torch.device = CPU) -> MachineLimits:
    """Measured now, with torch's present number of threads, the best of several runs."""
    source = torch.ones(COPY_BYTES // 4, device=device)
    target = torch.empty_like(source)
    copy_s = best_s(lambda: target.copy_(source), clock=clock)
    a, b = (torch.ones((MATRIX, MATRIX), device=device) for _ in range(2))
    product_s = best_s(lambda: torch.mm(a, b), clock=clock)
    return MachineLimits(2 * COPY_BYTES / copy_s * 1e-9, 2 * MATRIX**3 / product_s * 1e-9)


def best_s(
    run: Callable[[], object],
    repeats: int = REPEATS,
    clock: Clock = time.perf_counter,
) -> float:
    """The shortest time in seconds of several runs, after one that does not count."""
    run()
    times = []
    for _ in range(repeats):
        started = clock()
        run()
        times.append(clock() - started)
    return min(times)
