"""Parameters: frozen pydantic models, declared once beside the code that uses them.

A pure module takes its model as an argument; a service's ``config.py`` composes the models into
the section that people write. Every field says its unit and the reason for its default.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import BaseModel, ConfigDict


class Params(BaseModel):
    """Base of all parameters: immutable, unknown keys refused, no NaN or infinity.

    ``former_keys``: names that fields had in earlier releases, each with the field's name now.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    former_keys: ClassVar[Mapping[str, str]] = {}
