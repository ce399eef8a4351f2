"""``perception.detector``: which one, and its own settings."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from onemap_perception.detectors.boxes import BoxLimits
from onemap_perception.detectors.patches import PatchThresholds
from onemap_perception.encoders.params import Device
from onemap_shared.params import Params

COCO_MODEL = "PekingU/rtdetr_v2_r18vd"
OPEN_MODEL = "iSEE-Laboratory/llmdet_tiny"


class PatchesParams(Params):
    """The detector that reads the encoder's patch scores."""

    backend: Literal["patches"] = Field(
        default="patches", description="Chooses this detector: it costs no second network."
    )
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
        default=8, ge=1, le=256, description="Most detections per image and name."
    )

    def thresholds(self) -> PatchThresholds:
        """As the detector reads them."""
        return PatchThresholds(self.score, self.core, self.patches, self.detections)


class BoxDetectorParams(Params):
    """What the detectors of other people have in common. Scores of two are not one scale."""

    model: str = Field(description="A hub id or a folder.")
    allow_fetch: bool = Field(
        default=False, description="Fetch a missing model at start; off, a robot may be offline."
    )
    device: Device = Field(default="cpu", description="cpu, cuda or cuda:N.")
    score: float = Field(description="A box counts from here; each detector has its own scale.")
    detections: int = Field(default=16, ge=1, le=256, description="Most per image and name.")

    def limits(self) -> BoxLimits:
        """As the detector reads them."""
        return BoxLimits(self.score, self.detections)


class CocoParams(BoxDetectorParams):
    """RT-DETRv2: COCO's eighty names only."""

    backend: Literal["coco"] = Field(
        default="coco", description="Chooses this detector: fast, where its names are enough."
    )
    model: str = Field(default=COCO_MODEL, description="A hub id or a folder.")
    score: float = Field(
        default=0.5, gt=0, lt=1, description="A box counts from here; RT-DETR's usual value."
    )


class OpenVocabularyParams(BoxDetectorParams):
    """Any grounding detector of transformers: any name."""

    backend: Literal["open_vocabulary"] = Field(
        default="open_vocabulary",
        description="Chooses this detector: slow without a GPU, but no name is unknown to it.",
    )
    model: str = Field(default=OPEN_MODEL, description="A hub id or a folder.")
    score: float = Field(
        default=0.35, gt=0, lt=1, description="A box counts from here; GroundingDINO's own value."
    )


class RoutedParams(Params):
    """COCO's names to one, all others to the other, as in the paper."""

    backend: Literal["routed"] = Field(
        description="Chooses both detectors: the fast one wherever its names suffice."
    )
    coco: CocoParams = Field(default=CocoParams(), description="For COCO's names.")
    open_vocabulary: OpenVocabularyParams = Field(
        default=OpenVocabularyParams(), description="For all others."
    )


class PluginParams(Params):
    """A detector of another package; see docs/detectors.md."""

    backend: Literal["plugin"] = Field(description="Chooses a detector that is not OneMap's.")
    name: str = Field(description="Of the entry point in the group onemap.detectors.")
    options: dict[str, Any] = Field(default={}, description="Handed to it as they are.")


DetectorParams = Annotated[
    PatchesParams | CocoParams | OpenVocabularyParams | RoutedParams | PluginParams,
    Field(discriminator="backend"),
]
