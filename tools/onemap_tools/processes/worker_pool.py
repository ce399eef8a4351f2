"""Processes that compute for this one, and end with it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of processes that end with the context, or when this process does, however it died.

    What they still compute when the context ends is of no use: an error, or Ctrl-C. Nothing is
    cancelled, since a pool that breaks fails on a cancelled future. They are spawned, not forked:
    this process may hold threads of torch or onnxruntime. Each computes on one core: threads of
    BLAS would spin between the small products that they share, and their number changes sums.
    """
    spawn = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, spawn, initializer=_end_with_parent)
    unset = [name for name in THREAD_VARIABLES if name not in os.environ]
    os.environ.update(dict.fromkeys(unset, "1"))  # inherited, and read by numpy's first import
    try:
        yield pool
    finally:
        for name in unset:
            del os.environ[name]
        for worker in multiprocessing.active_children():
            worker.terminate()
        pool.shutdown()


def _end_with_parent() -> None:
    """End this worker when its parent has ended, and leave Ctrl-C to the parent.

    The pool alone ends its workers only where its process ends by itself: after SIGKILL or
    SIGTERM they would compute on, and then wait for work for ever.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None  # a worker has one

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, name="watch-parent", daemon=True).start()
