"""Messages that cannot be built: a valid sample with some fields replaced."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

import pytest

from tests.shared.samples import SAMPLES

M = TypeVar("M")


def sample(cls: type[M]) -> M:
    """The valid message of this type."""
    return next(message for message in SAMPLES if isinstance(message, cls))


def assert_refused(cls: type[Any], reason: str, **changes: Any) -> None:
    """The sample of this type with these changes raises ValueError with this reason."""
    with pytest.raises(ValueError, match=reason):
        dataclasses.replace(sample(cls), **changes)
