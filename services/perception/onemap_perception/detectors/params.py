"""Parameters of the detectors: the section ``perception.detector``."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from onemap_perception.encoders.params import Device
from onemap_shared.params import Params

COCO_MODEL = "PekingU/rtdetr_v2_r18vd"
OPEN_MODEL = "iSEE-Laboratory/llmdet_tiny"


class PatchesParams(Params):
    """The detector that reads the encoder's patch scores."""

    backend: Literal["patches"] = Field(
        default="patches", description="Chooses this detector: it costs no second network."
    )


class CocoParams(Params):
    """RT-DETRv2: COCO's eighty names only."""

    backend: Literal["coco"] = Field(
        default="coco", description="Chooses this detector: fast, where its names are enough."
    )
    model: str = Field(default=COCO_MODEL, description="A hub id or a folder.")
    device: Device = Field(default="cpu", description="cpu, cuda or cuda:N.")
    score_threshold: float = Field(
        default=0.5, gt=0, lt=1, description="A box counts from here; RT-DETR's usual value."
    )


class GroundingParams(Params):
    """A grounding network of transformers, for any name."""

    model: str = Field(default=OPEN_MODEL, description="A hub id or a folder.")
    device: Device = Field(default="cpu", description="cpu, cuda or cuda:N.")
    score_threshold: float = Field(
        default=0.35, gt=0, lt=1, description="A box counts from here; GroundingDINO's own value."
    )


class OpenVocabularyParams(GroundingParams):
    """Any name, each in a run of its own."""

    backend: Literal["open_vocabulary"] = Field(
        default="open_vocabulary",
        description="Chooses this detector: slow without a GPU, but it accepts every name.",
    )


class RoutedParams(GroundingParams):
    """COCO's names to RT-DETRv2 at its own threshold, all others to the model: the paper's."""

    backend: Literal["routed"] = Field(
        default="routed",
        description="Chooses both detectors: the fast one wherever its names suffice.",
    )

    coco_model: str = Field(default=COCO_MODEL, description="For COCO's names; as model.")

    @property
    def coco(self) -> CocoParams:
        """Of the detector for COCO's names."""
        return CocoParams(model=self.coco_model, device=self.device)

    @property
    def open_vocabulary(self) -> OpenVocabularyParams:
        """Of the detector for all others."""
        return OpenVocabularyParams(**self.model_dump(exclude={"backend", "coco_model"}))


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
