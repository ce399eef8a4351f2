"""The ``perception`` section of the configuration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from onemap_perception.errors import OPEN_CLIP, TRANSFORMERS
from onemap_perception.feature_field import VarianceFormula
from onemap_shared.params import Params

if TYPE_CHECKING:
    import torch

    from onemap_perception.detectors.boxes import BoxNetwork
    from onemap_perception.encoders.torch_encoder import VisionLanguageModel

SHIPPED = Path(__file__).with_name("mini")  # weights and words
Device = Annotated[str, Field(pattern=r"^(cpu|cuda(:\d+)?)$")]
LongSide = Annotated[
    int,
    Field(ge=14, le=2048, description="Pixels of the longer side fed in; the shape is kept."),
]


@dataclass(frozen=True, slots=True)
class KnownModel:
    """A tested model of the hub. files: patterns of those needed; about_mb: computed from the
    number of parameters, None if unknown; licence: of the weights."""

    repo: str
    backend: str
    licence: str
    about_mb: int | None
    files: tuple[str, ...]


OPEN_CLIP_FILES = ("open_clip_config.json", "open_clip_model.safetensors")
TRANSFORMERS_FILES = ("*.json", "*.txt", "*.model", "*.safetensors")


@dataclass(frozen=True, slots=True)
class Package:
    """What must be importable for a network: ``attribute`` of ``module``. name, install: the
    package as it is called, and the command for it."""

    name: str
    install: str
    module: str
    attribute: str


class NetworkParams(Params):
    """A network of the hub or of the user's own files. A subclass is all that is to be told of one
    outside the module that computes it."""

    package: ClassVar[Package]
    tested: ClassVar[tuple[KnownModel, ...]]  # the first is the one that its name stands for

    backend: str = Field(description="Chooses this network.")
    model: str = Field(
        description="A hub id that 'onemap models use' has fetched, or a file or folder."
    )
    device: Device = Field(default="cpu", description="cpu, cuda or cuda:N; cuda in fp16.")

    @property
    def files(self) -> tuple[str, ...]:
        """Patterns of the files needed, of a model of the hub."""
        return next((known.files for known in self.tested if known.repo == self.model), ("*",))


class ChannelParams(Params):
    """How many channels an encoder's features have."""

    channels: int = Field(
        default=0,
        ge=0,
        le=8192,
        description="Project features and texts to so many channels, at least 2, fitted at start "
        "on the embeddings of 826 everyday words; the map shrinks as the messages do. 128 of "
        "mini's 384 keep the order of places. 0: all.",
    )


class MiniParams(ChannelParams):
    """The encoder of the simulator."""

    backend: Literal["mini"] = Field(
        default="mini", description="Chooses this encoder: it ships with OneMap and needs no GPU."
    )
    folder: Path = Field(
        default=SHIPPED,
        description="Folder of weights and words: that of OneMap, or of your own training.",
    )


class TorchEncoderParams(ChannelParams, NetworkParams):
    """What the encoders of vision and text towers in torch have in common."""

    floor: float = Field(
        default=0.0,
        ge=0,
        lt=1,
        description="A query whose best score is lower gets no region. 0: fitted to each map, by "
        "words of what no home has, and used as mapper.found_score too.",
    )

    def load(self, path: Path, device: torch.device) -> VisionLanguageModel:
        """The model at ``path``; imports torch. Raises BackendError."""
        raise NotImplementedError


class OpenClipConvNextParams(TorchEncoderParams):
    """OpenCLIP's ConvNeXt, the paper's encoder among them."""

    package = Package("open_clip", OPEN_CLIP, "open_clip.model", "CLIP")
    tested = (
        KnownModel(
            "laion/CLIP-convnext_large_d_320.laion2B-s29B-b131K-ft-soup",
            "openclip_convnext",
            "MIT",
            1410,
            OPEN_CLIP_FILES,
        ),
        KnownModel(
            "laion/CLIP-convnext_base_w-laion2B-s13B-b82K-augreg",
            "openclip_convnext",
            "see its page",
            720,
            OPEN_CLIP_FILES,
        ),
    )

    backend: Literal["openclip_convnext"] = Field(
        default="openclip_convnext",
        description="Chooses this encoder: the paper's, any word, a GPU is advised.",
    )
    long_side_px: LongSide = 640

    def load(self, path: Path, device: torch.device) -> VisionLanguageModel:
        """See ``TorchEncoderParams``."""
        from onemap_perception.encoders.openclip_convnext import load_openclip_convnext

        return load_openclip_convnext(path, device)


class Tipsv2Params(TorchEncoderParams):
    """TIPSv2 through transformers."""

    package = Package("transformers 5.23 or later", TRANSFORMERS, "transformers", "Tipsv2Model")
    tested = (
        KnownModel("google/tipsv2-b14", "tipsv2", "Apache-2.0", None, TRANSFORMERS_FILES),
        KnownModel("google/tipsv2-l14", "tipsv2", "Apache-2.0", None, TRANSFORMERS_FILES),
    )

    backend: Literal["tipsv2"] = Field(
        default="tipsv2",
        description="Chooses this encoder: any word, trained for features of single patches.",
    )
    long_side_px: LongSide = 448

    def load(self, path: Path, device: torch.device) -> VisionLanguageModel:
        """See ``TorchEncoderParams``."""
        from onemap_perception.encoders.tipsv2 import load_tipsv2

        return load_tipsv2(path, device)


class PluginEncoderParams(ChannelParams):
    """An encoder of another package; see docs/encoders.md."""

    backend: Literal["plugin"] = Field(
        default="plugin", description="Chooses an encoder that is not OneMap's."
    )
    name: str = Field(description="Of the entry point in the group onemap.encoders.")
    options: dict[str, Any] = Field(
        default={}, description="Keyword arguments of the plugin, passed on unchanged."
    )


TorchParams = OpenClipConvNextParams | Tipsv2Params
EncoderParams = Annotated[
    MiniParams | TorchParams | PluginEncoderParams, Field(discriminator="backend")
]

COCO_MODEL = "PekingU/rtdetr_v2_r18vd"
OPEN_MODEL = "iSEE-Laboratory/llmdet_tiny"


class PatchesParams(Params):
    """The detector that reads the encoder's patch scores."""

    backend: Literal["patches"] = Field(
        default="patches", description="Chooses this detector: it costs no second network."
    )


class CocoParams(NetworkParams):
    """RT-DETRv2: COCO's eighty names only."""

    package = Package("transformers", TRANSFORMERS, "transformers", "RTDetrV2ForObjectDetection")
    tested = (KnownModel(COCO_MODEL, "coco", "Apache-2.0", 81, TRANSFORMERS_FILES),)

    backend: Literal["coco"] = Field(
        default="coco", description="Chooses this detector: fast, where its names are enough."
    )
    model: str = Field(default=COCO_MODEL, description="A hub id or a folder.")
    device: Device = Field(default="cpu", description="cpu, cuda or cuda:N.")
    score_threshold: float = Field(
        default=0.5, gt=0, lt=1, description="A box counts from here; RT-DETR's usual value."
    )

    def load(self, path: Path, device: torch.device) -> BoxNetwork:
        """The network at ``path``; imports torch. Raises BackendError."""
        from onemap_perception.detectors.networks import CocoNetwork

        return CocoNetwork(path, device)


class GroundingParams(Params):
    """A grounding network of transformers, for any name."""

    model: str = Field(default=OPEN_MODEL, description="A hub id or a folder.")
    device: Device = Field(default="cpu", description="cpu, cuda or cuda:N.")
    score_threshold: float = Field(
        default=0.35, gt=0, lt=1, description="A box counts from here; GroundingDINO's own value."
    )


class OpenVocabularyParams(GroundingParams, NetworkParams):
    """Any name, each in a run of its own."""

    package = Package(
        "transformers", TRANSFORMERS, "transformers", "AutoModelForZeroShotObjectDetection"
    )
    tested = (
        KnownModel(OPEN_MODEL, "open_vocabulary", "Apache-2.0", None, TRANSFORMERS_FILES),
        KnownModel(
            "omlab/omdet-turbo-swin-tiny-hf",
            "open_vocabulary",
            "Apache-2.0",
            None,
            TRANSFORMERS_FILES,
        ),
    )

    backend: Literal["open_vocabulary"] = Field(
        default="open_vocabulary",
        description="Chooses this detector: slow without a GPU, but it accepts every name.",
    )

    def load(self, path: Path, device: torch.device) -> BoxNetwork:
        """The network at ``path``; imports torch. Raises BackendError."""
        from onemap_perception.detectors.networks import GroundingNetwork

        return GroundingNetwork(path, device)


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
# Every network with a name of its own, by that name.
ENCODER_NETWORKS: dict[str, type[TorchParams]] = {
    params.model_fields["backend"].default: params for params in get_args(TorchParams)
}
DETECTOR_NETWORKS: dict[str, type[BoxParams]] = {
    params.model_fields["backend"].default: params for params in get_args(BoxParams)
}
KNOWN_MODELS: tuple[KnownModel, ...] = tuple(
    model
    for params in (*ENCODER_NETWORKS.values(), *DETECTOR_NETWORKS.values())
    for model in params.tested
)
DetectorParams = Annotated[
    PatchesParams | BoxParams | RoutedParams | PluginParams, Field(discriminator="backend")
]


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

    @field_validator("encoder", mode="before")
    @classmethod
    def _refuse_photo(cls, encoder: Any) -> Any:
        if isinstance(encoder, dict) and encoder.get("backend") == "photo":
            raise PydanticCustomError(
                "gone",
                "the encoder photo is gone since 0.3.0: use one of the model hub ('onemap models "
                "use tipsv2'), or mini in the simulator",
            )
        return encoder

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
