"""Errors of encoders and detectors, and what a missing optional library becomes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager


class BackendError(Exception):
    """A model is missing or cannot be loaded, or failed on an image; a sentence for the user."""


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


NO_DEPS = "pip install --no-deps -r requirements/encoders.txt"
OPEN_CLIP = f"pip install -e '.[openclip]' && {NO_DEPS}"
TRANSFORMERS = f"pip install -e '.[transformers]' && {NO_DEPS}"


@contextmanager
def optional_import(library: str, install: str, *, backend: str) -> Iterator[None]:
    """Around the imports of a backend; raises BackendError with the command that installs it.

    A torchvision that was built for another torch raises RuntimeError when it is imported.
    """
    try:
        yield
    except ImportError as missing:
        raise BackendError(f"{backend} needs {library}, and {missing}: {install}") from missing
    except RuntimeError as problem:
        raise BackendError(
            f"{backend} needs {library}, and importing it failed ({first_line(problem)}): "
            "install the torchvision that was built for the installed torch"
        ) from problem
