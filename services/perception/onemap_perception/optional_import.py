"""Imports optional dependencies, with an install hint if one is absent."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from onemap_perception.errors import BackendError, first_line

NO_DEPS = "pip install --no-deps -r requirements/encoders.txt"
OPEN_CLIP = f"pip install 'onemap[openclip]' && {NO_DEPS}"
TRANSFORMERS = f"pip install 'onemap[transformers]' && {NO_DEPS}"


@contextmanager
def optional_import(
    library: str, install: str, *, backend: str, kind: type[BackendError]
) -> Iterator[None]:
    """Around the imports of a backend; raises ``kind`` with the command that installs it.

    A torchvision that was built for another torch raises RuntimeError when it is imported.
    """
    try:
        yield
    except ImportError as missing:
        raise kind(f"{backend} needs {library}, and {missing}: {install}") from missing
    except RuntimeError as problem:
        raise kind(
            f"{backend} needs {library}, and importing it failed ({first_line(problem)}): "
            "install the torchvision that was built for the installed torch"
        ) from problem
