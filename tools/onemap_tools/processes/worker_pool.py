"""Processes that compute for this one, and end with it."""

from __future__ import annotations

import multiprocessing
import os
import threading
from concurrent.futures import ProcessPoolExecutor


def worker_pool(workers: int) -> ProcessPoolExecutor:
    """A pool of processes that end when this process does, however it died.

    They are spawned, not forked: this process may hold threads of torch or onnxruntime.
    """
    spawn = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(workers, spawn, initializer=_end_with_parent)


def _end_with_parent() -> None:
    """End this worker when its parent has ended.

    The pool alone ends its workers only where its process ends by itself: after SIGKILL or
    SIGTERM they would compute on, and then wait for work for ever.
    """
    parent = multiprocessing.parent_process()
    assert parent is not None  # a worker has one

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, name="watch-parent", daemon=True).start()
