"""Memory of a long computation on a CPU."""

from __future__ import annotations

import ctypes
import sys

TRIM_THRESHOLD, MMAP_MAX = -1, -4  # glibc, malloc.h
NEVER = 2**31 - 1


def keep_freed_memory() -> bool:
    """Keep what is freed for the next step; returns whether the C library can.

    By default glibc hands large arrays back to the kernel, and every step faults their pages in
    again.
    """
    if sys.platform != "linux":
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # musl has none
    return mallopt is not None and bool(mallopt(MMAP_MAX, 0) and mallopt(TRIM_THRESHOLD, NEVER))
