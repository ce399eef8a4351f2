"""Compile numeric functions with numba.

The machine code is kept on disk, so that only the first start on a machine compiles: in
NUMBA_CACHE_DIR if that is set, else in __pycache__ beside the source, else in the user's cache
folder. Where none of them can be written, every start compiles.

numba renews the code of a function when the file that defines it changes, not when a file changes
that it calls into: a compiled function calls only functions of its own file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any, TypeVar

import numba
from numba.core import event

F = TypeVar("F", bound=Callable[..., Any])


@contextmanager
def on_compilation(announce: Callable[[str], None]) -> Iterator[None]:
    """Say once in one sentence that functions are compiled, when the first of them is.

    Not called where all code is loaded from disk.
    """
    announced = False

    class First(event.Listener):  # type: ignore[misc]
        def on_start(self, compilation: Any) -> None:
            nonlocal announced
            if not announced:
                announced = True
                announce(_announcement(compilation.data["dispatcher"].stats.cache_path))

        def on_end(self, compilation: Any) -> None: ...

    with event.install_listener("numba:compile", First()):
        yield


@contextmanager
def announced(
    takes: Callable[[str, float], AbstractContextManager[None]],
    usual_s: float,
    log: Callable[[str], object],
) -> Iterator[None]:
    """While functions are compiled, a start says so in its log and by ``StartReport.takes``."""
    with ExitStack() as compilation:

        def announce(what: str) -> None:
            log(what)
            compilation.enter_context(takes(what, usual_s))

        with on_compilation(announce):
            yield


def _announcement(folder: str | None) -> str:
    """folder: that keeps the code; None where none can be written."""
    if folder is None:
        return (
            "compiling kernels, at every start: no folder for their code can be "
            "written; set NUMBA_CACHE_DIR to one that can"
        )
    return f"compiling kernels, once; cached in {folder}"


def compiled(function: F) -> F:
    """The function, compiled at its first call.

    Arithmetic keeps its order, so that results do not depend on the processor; the interpreter's
    lock is released meanwhile.
    """
    return _compile(function, fastmath=False)


def compiled_fast(function: F) -> F:
    """As ``compiled``, but sums may be reordered: for products, where torch's order is free too."""
    return _compile(function, fastmath={"reassoc", "contract", "nsz"})


def _compile(function: F, *, fastmath: bool | set[str]) -> F:
    options = {"nogil": True, "fastmath": fastmath, "error_model": "numpy"}
    try:
        made: F = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no folder for the cache can be written
        made = numba.njit(**options)(function)
    return made
