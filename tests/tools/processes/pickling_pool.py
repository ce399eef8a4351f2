"""A pool that starts at once."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any


class PicklingPool(ThreadPoolExecutor):
    """Threads whose work and results pass through pickle, as those of other processes do."""

    def submit(self, work: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        sent = pickle.dumps((work, arguments, options))

        def run() -> Any:
            work, arguments, options = pickle.loads(sent)
            return pickle.loads(pickle.dumps(work(*arguments, **options)))

        return super().submit(run)
