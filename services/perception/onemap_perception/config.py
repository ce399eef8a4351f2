"""The ``perception`` section of the configuration."""

from __future__ import annotations

from typing import Any

from pydantic import Field, model_validator

from onemap_perception.detectors.params import DetectorParams, PatchesParams
from onemap_perception.encoders.mini import MiniParams
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.feature_field import VarianceFormula
from onemap_shared.params import Params


class PerceptionConfig(Params):
    """The section ``perception``. ``mini: {...}`` is short for an encoder of that backend,
    ``patches: {...}`` for a detector of that one."""

    encoder: EncoderParams = Field(
        default=MiniParams(), description="Images and words to one space; backend chooses."
    )
    detector: DetectorParams = Field(
        default=PatchesParams(), description="Finds the objects of a search; backend chooses."
    )
    variance: VarianceFormula = Field(
        default=VarianceFormula.RELEASED,
        description="How uncertain the feature of each pixel is: by the authors' code, or as the "
        "paper prints it.",
    )

    @model_validator(mode="before")
    @classmethod
    def _spell_out(cls, section: Any) -> Any:
        if not isinstance(section, dict):
            return section
        full = dict(section)
        for short, name in (("mini", "encoder"), ("patches", "detector")):
            if short in full and name not in full and isinstance(full[short], dict):
                full[name] = {"backend": short, **full.pop(short)}
        return full
