"""Joining the bus for a while, as a visitor."""

from __future__ import annotations

import logging
import threading
import uuid
from collections.abc import Iterator
from contextlib import contextmanager

from onemap_shared.bus import open_bus
from onemap_shared.config import BusConfig
from onemap_shared.transport import Bus
from onemap_tools.trouble import Trouble


@contextmanager
def joined(config: BusConfig, name: str, patience_s: float) -> Iterator[Bus]:
    """The bus; Trouble if there is no router within ``patience_s``."""
    logging.getLogger("onemap.bus").setLevel(logging.ERROR)  # Trouble says it better
    gave_up = threading.Event()
    timer = threading.Timer(patience_s, gave_up.set)
    timer.start()
    try:
        bus = open_bus(config, name, uuid.uuid4().hex[:12], gave_up)
    finally:
        timer.cancel()
    if bus is None:
        raise Trouble(
            f"No router at {', '.join(config.connect)}: start everything with 'onemap up', or the "
            "router alone with 'onemap router'; another address goes into bus.connect of --config."
        )
    try:
        yield bus
    finally:
        bus.close()
