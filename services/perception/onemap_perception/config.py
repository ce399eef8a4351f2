"""The ``perception`` section of the configuration."""

from __future__ import annotations

from typing import Any

from pydantic import Field, model_validator

from onemap_perception.detectors.params import DetectorParams, PatchesParams
from onemap_perception.encoders.params import EncoderParams, MiniParams
from onemap_perception.variance import VarianceFormula, VarianceParams
from onemap_shared.params import Params


class ObservationConfig(Params):
    """The variance of a pixel's feature; see ``observation.VarianceParams``."""

    formula: VarianceFormula = Field(
        default=VarianceFormula.RELEASED, description="released (the authors' code) or paper."
    )
    optimal_distance_m: float = Field(
        default=1.0, ge=0, le=20, description="Metres at which things are recognised best."
    )
    gradient_factor: float = Field(
        default=0.2, gt=0, description="Released: how much a depth edge costs."
    )
    distance_factor_m: float = Field(
        default=1.5, gt=0, description="Released, metres: how fast trust fades with distance."
    )
    epsilon: float = Field(
        default=0.1, gt=0, description="Paper: variance of a flat surface at the best distance."
    )
    min_confidence: float = Field(
        default=1e-5, gt=0, description="Pixels trusted less than this are not used."
    )

    def model(self) -> VarianceParams:
        """As the computation reads it."""
        return VarianceParams(**self.model_dump())


class PerceptionConfig(Params):
    """Everything perception can be told. ``mini: {...}`` is short for an encoder of that
    backend, ``patches: {...}`` for a detector of that one."""

    encoder: EncoderParams = Field(
        default=MiniParams(), description="Images and words to one space; backend chooses."
    )
    detector: DetectorParams = Field(
        default=PatchesParams(), description="Finds what is searched for; backend chooses."
    )
    observation: ObservationConfig = Field(
        default=ObservationConfig(), description="The variance model."
    )
    silent_after_s: float = Field(
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
