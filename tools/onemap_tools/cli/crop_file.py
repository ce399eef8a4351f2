"""Reads the picture of a query."""

from __future__ import annotations

from pathlib import Path

from onemap_shared.messages import check_image
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError


def read_crop(path: Path) -> bytes:
    """A PNG or JPEG that may be asked for; CliError says what is wrong with another file."""
    try:
        data = path.read_bytes()
        check_image(data)
    except OSError as problem:
        raise CliError(f"cannot read {path}: {problem.strerror}", EXIT_USAGE_ERROR) from problem
    except ValueError as problem:
        raise CliError(f"{path}: {problem}", EXIT_USAGE_ERROR) from problem
    return data
