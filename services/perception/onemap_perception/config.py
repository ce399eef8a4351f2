"""The ``perception`` section of the configuration."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from onemap_perception.detectors.patches import PatchThresholds
from onemap_perception.encoders.mini import SHIPPED, MiniSettings
from onemap_perception.observation import ObservationModel, VarianceFormula
from onemap_shared.config import StrictModel


class MiniConfig(StrictModel):
    """The encoder that ships with OneMap."""

    folder: Path = Field(
        default=SHIPPED, description="Weights and words; another folder holds one's own training."
    )
    threads: int = Field(
        default=1, ge=1, le=64, description="One is fast enough, the other cores have work too."
    )
    input_width_px: int = Field(
        default=320,
        ge=8,
        le=4096,
        description="Wider pictures are reduced to this: what the network was trained on.",
    )

    def settings(self) -> MiniSettings:
        """As the encoder reads them."""
        return MiniSettings(self.folder, self.threads, self.input_width_px)


class PatchesConfig(StrictModel):
    """The detector that reads the encoder's patch scores."""

    score: float = Field(
        default=0.4, gt=0, lt=1, description="From this score on a patch belongs to the thing."
    )
    core: float = Field(
        default=0.8,
        gt=0,
        lt=1,
        description="At least one patch must be this sure: false finds cost more than late ones.",
    )
    patches: int = Field(
        default=3, ge=1, description="Fewer connected patches are taken for noise."
    )
    detections: int = Field(
        default=8, ge=1, le=256, description="Most detections per picture and name."
    )

    def thresholds(self) -> PatchThresholds:
        """As the detector reads them."""
        return PatchThresholds(**self.model_dump())


class ObservationConfig(StrictModel):
    """The variance of a pixel's feature; see ``observation.ObservationModel``."""

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

    def model(self) -> ObservationModel:
        """As the computation reads it."""
        return ObservationModel(**self.model_dump())


class PerceptionConfig(StrictModel):
    """Everything perception can be told."""

    mini: MiniConfig = Field(default=MiniConfig(), description="The encoder.")
    patches: PatchesConfig = Field(default=PatchesConfig(), description="The detector.")
    observation: ObservationConfig = Field(
        default=ObservationConfig(), description="The variance model."
    )
    silent_after_s: float = Field(
        default=5.0,
        gt=0,
        le=60,
        description="Seconds without a camera frame after which perception is not ready.",
    )
