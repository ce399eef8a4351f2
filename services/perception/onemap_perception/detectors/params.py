"""Parameters of the detectors: the section ``perception.detector``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from onemap_perception.detectors.patches import PatchesParams
from onemap_perception.encoders.params import Device
from onemap_shared.params import Params

COCO_MODEL = "PekingU/rtdetr_v2_r18vd"
OPEN_MODEL = "iSEE-Laboratory/llmdet_tiny"


class BoxDetectorParams(Params):
    """What the detectors of boxes have in common. Scores of two networks are not one scale."""

    former_keys: ClassVar[Mapping[str, str]] = {
        "score": "score_threshold",
        "detections": "max_detections",
    }

    allow_fetch: bool = Field(
        default=False, description="Fetch a missing model at start; off, a robot may be offline."
    )
    device: Device = Field(default="cpu", description="cpu, cuda or cuda:N.")
    max_detections: int = Field(default=16, ge=1, le=256, description="Most per image and name.")


class CocoParams(BoxDetectorParams):
    """RT-DETRv2: COCO's eighty names only."""

    backend: Literal["coco"] = Field(
        default="coco", description="Chooses this detector: fast, where its names are enough."
    )
    model: str = Field(default=COCO_MODEL, description="A hub id or a folder.")
    score_threshold: float = Field(
        default=0.5, gt=0, lt=1, description="A box counts from here; RT-DETR's usual value."
    )


class OpenVocabularyParams(BoxDetectorParams):
    """Any grounding detector of transformers: any name."""

    backend: Literal["open_vocabulary"] = Field(
        default="open_vocabulary",
        description="Chooses this detector: slow without a GPU, but it accepts every name.",
    )
    model: str = Field(default=OPEN_MODEL, description="A hub id or a folder.")
    score_threshold: float = Field(
        default=0.35, gt=0, lt=1, description="A box counts from here; GroundingDINO's own value."
    )


class RoutedParams(Params):
    """COCO's names to one, all others to the other, as in the paper."""

    backend: Literal["routed"] = Field(
        default="routed",
        description="Chooses both detectors: the fast one wherever its names suffice.",
    )
    coco: CocoParams = Field(default=CocoParams(), description="For COCO's names.")
    open_vocabulary: OpenVocabularyParams = Field(
        default=OpenVocabularyParams(), description="For all others."
    )


class PluginParams(Params):
    """A detector of another package; see docs/detectors.md."""

    backend: Literal["plugin"] = Field(
        default="plugin", description="Chooses a detector that is not OneMap's."
    )
    name: str = Field(description="Of the entry point in the group onemap.detectors.")
    options: dict[str, Any] = Field(
        default={}, description="Keyword arguments of the plugin, passed on unchanged."
    )


BoxParams = CocoParams | OpenVocabularyParams
DetectorParams = Annotated[
    PatchesParams | BoxParams | RoutedParams | PluginParams, Field(discriminator="backend")
]
