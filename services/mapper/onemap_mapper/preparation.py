"""What the mapper does once before it joins its robots: compile, or load what was compiled."""
# Talks: says on the bus and in the log that it compiles.

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from contextlib import ExitStack

from onemap_mapper import jit
from onemap_mapper.config import MapperConfig
from onemap_mapper.robots import SERVICE
from onemap_mapper.warm_up import warm_up
from onemap_shared.runner import long_start
from onemap_shared.transport import Bus

LOG = logging.getLogger("onemap.mapper")

COMPILATION_S = 45.0  # on two cores; only said, nothing ends after it


def prepare(buses: Sequence[Bus], config: MapperConfig) -> None:
    """Warm up; while functions are compiled, heartbeats say so to each robot."""
    started_s = time.monotonic()
    with ExitStack() as compilation:

        def announce(what: str) -> None:
            LOG.info("%s", what)
            for bus in buses:
                compilation.enter_context(long_start(bus, SERVICE, what, COMPILATION_S))

        with jit.on_compilation(announce):
            warm_up(config.map)
    LOG.info(
        "%s; the first frame was prepared in %.1f s",
        jit.described(),
        time.monotonic() - started_s,
    )
