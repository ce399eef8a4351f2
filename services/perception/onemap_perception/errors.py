"""Errors of encoders and detectors."""

from __future__ import annotations

from collections.abc import Mapping


class BackendError(Exception):
    """A network cannot be loaded or failed on an image; one sentence for the user."""


class ModelError(BackendError):
    """A model is missing, damaged or unknown; one sentence that says what to do."""


class OutOfDeviceMemoryError(BackendError):
    """The accelerator's memory is full; the next image may fit again."""


class UnknownWordError(Exception):
    """Texts without an embedding; one sentence for the user, with what to do.

    ``words``: all of them, each with the known words nearest to it.
    """

    def __init__(self, message: str, words: Mapping[str, tuple[str, ...]]) -> None:
        super().__init__(message)
        self.words = dict(words)


def first_line(problem: Exception) -> str:
    """The first line of the text of a library's exception."""
    return (str(problem).strip() or repr(problem)).splitlines()[0]


class ImageError(Exception):
    """A picture that cannot be a query; one sentence for the user, with what to do."""
