"""What can go wrong with a network."""

from __future__ import annotations


class BackendError(Exception):
    """A network cannot be loaded or failed on an image; one sentence for the user."""


class OutOfDeviceMemoryError(BackendError):
    """The accelerator's memory is full; the next image may fit again."""
