"""The ``perception`` section of the configuration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field, model_validator

from onemap_perception.detectors.params import DetectorParams
from onemap_perception.detectors.patches import PatchesParams
from onemap_perception.encoders.mini import MiniParams
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.variance import VarianceParams
from onemap_shared.params import Params


class PerceptionConfig(Params):
    """The section ``perception``. ``mini: {...}`` is short for an encoder of that backend,
    ``patches: {...}`` for a detector of that one."""

    former_keys: ClassVar[Mapping[str, str]] = {"silent_after_s": "frame_timeout_s"}

    encoder: EncoderParams = Field(
        default=MiniParams(), description="Images and words to one space; backend chooses."
    )
    detector: DetectorParams = Field(
        default=PatchesParams(), description="Finds the objects of a search; backend chooses."
    )
    observation: VarianceParams = Field(
        default=VarianceParams(), description="How uncertain the feature of each pixel is."
    )
    frame_timeout_s: float = Field(
        default=5.0,
        gt=0,
        le=60,
        description="Seconds without a camera frame after which perception is not ready.",
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
