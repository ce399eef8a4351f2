"""Parameters: frozen pydantic models, declared once beside the code that uses them.

A pure module takes its model as an argument; a service's ``config.py`` composes the models into
the section that people write. Every field says its unit and the reason for its default.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict


class Params(BaseModel):
    """Base of all parameters: immutable, unknown keys refused, no NaN or infinity.

    ``former_keys``: names that fields had in earlier releases, each with the field's name now.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    former_keys: ClassVar[Mapping[str, str]] = {}


def is_secret(key: str) -> bool:
    """Whether the value of a setting is a secret: taken as it is written, and never shown."""
    return key == "token" or key.endswith("_token")


def masked(value: Any) -> Any:
    """``value`` with stars for every secret in it."""
    if isinstance(value, Mapping):
        return {k: "***" if is_secret(str(k)) else masked(v) for k, v in value.items()}
    return [masked(item) for item in value] if isinstance(value, list | tuple) else value
