"""What can go wrong with a network."""

from __future__ import annotations


class Fault(Exception):
    """A network cannot be loaded or failed on a picture; one sentence for the user."""


class OutOfDeviceMemoryError(Fault):
    """The accelerator's memory is full; the next picture may fit again."""
