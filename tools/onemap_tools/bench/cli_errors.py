"""What a benchmark tells of errors that can be foreseen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra


@contextmanager
def cli_errors(extra: str) -> Iterator[None]:
    """Turn foreseeable errors into a CliError; ``extra`` installs the benchmark's packages."""
    try:
        with requires_extra(extra, "This benchmark"):
            yield
    except ValueError as problem:
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
