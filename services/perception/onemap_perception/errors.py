"""Errors of encoders and detectors, and what a missing optional library becomes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from typing import Any


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


TORCHVISION_OPERATORS = (
    "nms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor",
    "qnms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor",
)
_declared: list[Any] = []  # a library's declarations last as long as the object


def import_torchvision() -> None:
    """Import an installed torchvision, also one whose binaries do not load beside this torch.

    open_clip and transformers import it. PyPI's is built for CUDA: beside a torch without CUDA
    its import ends with "operator torchvision::nms does not exist". The operators that it
    registers are then declared without an implementation: no model here calls one.
    """
    if find_spec("torch") is None or find_spec("torchvision") is None:
        return
    try:
        import_module("torchvision")
    except RuntimeError as problem:
        if "torchvision::nms does not exist" not in str(problem):
            raise
        library = import_module("torch.library").Library("torchvision", "DEF")
        for schema in TORCHVISION_OPERATORS:
            library.define(schema)
        _declared.append(library)
        import_module("torchvision")


@contextmanager
def optional_import(library: str, install: str, *, backend: str) -> Iterator[None]:
    """Around the imports of a backend; raises BackendError with the command that installs it.

    A torchvision for another CUDA than the torch's raises RuntimeError when it is imported.
    """
    try:
        import_torchvision()
        yield
    except ImportError as missing:
        raise BackendError(f"{backend} needs {library}, and {missing}: {install}") from missing
    except RuntimeError as problem:
        raise BackendError(
            f"{backend} needs {library}, and importing it failed ({first_line(problem)}): "
            "install the torchvision of the installed torch, from the index that torch is from"
        ) from problem
