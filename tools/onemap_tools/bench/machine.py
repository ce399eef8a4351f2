"""Times by the clock or the processor, and what a figure must say of the machine."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:  # planning is measured without torch
    import torch

Clock = Callable[[], float]  # seconds


def wall_clock(device: torch.device) -> Clock:
    """The time at which all is done that was asked of a device: a GPU only takes orders."""
    if device.type != "cuda":
        return time.perf_counter
    import torch

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


def best_ms(run: Callable[[], object], clock: Clock, repeats: int = 3) -> float:
    """The shortest time in milliseconds of several runs, after one that does not count."""
    run()
    times = []
    for _ in range(repeats):
        started = clock()
        run()
        times.append(clock() - started)
    return round(min(times) * 1e3, 3)


def spread_ms(times_ms: Sequence[float], prefix: str = "") -> dict[str, float]:
    """Least, median and longest in twenty of several times."""
    least, p50, p95 = np.quantile(times_ms, (0.0, 0.5, 0.95))
    values = {"min": least, "p50": p50, "p95": p95}
    return {f"{prefix}{name}_ms": round(float(value), 3) for name, value in values.items()}


def machine_facts(device: torch.device | None = None) -> dict[str, Any]:
    """Cores and load; of torch its threads; of a GPU its name and the most that tensors took."""
    facts: dict[str, Any] = {
        "cores": len(os.sched_getaffinity(0)),
        "load_average": round(os.getloadavg()[0], 2),
    }
    if device is not None:
        import torch

        facts |= {"device": str(device), "threads": torch.get_num_threads()}
        if device.type == "cuda":
            facts["device_name"] = torch.cuda.get_device_name(device)
            facts["peak_device_bytes"] = torch.cuda.max_memory_allocated(device)
    return facts


def peak_process_bytes() -> int:
    """The most memory that this process had resident until now."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def parse_size(text: str) -> tuple[int, int]:
    """Width and height of ``640x480``; raises ValueError."""
    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) and int(height)):
        raise ValueError(f"size is {text!r}; write it like 640x480")
    return int(width), int(height)
