"""Parameters of the encoders: the section ``perception.encoder``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from onemap_perception.encoders.mini import MiniParams
from onemap_perception.encoders.projected import ChannelParams
from onemap_shared.params import Params

Device = Annotated[str, Field(pattern=r"^(cpu|cuda(:\d+)?)$")]
Prompt = Annotated[str, Field(pattern=r"^[^{}]*\{\}[^{}]*$")]
Pixels = Annotated[int, Field(ge=1, le=8192)]


class TowerParams(Params):
    """Where and how a vision tower runs."""

    device: Device = Field(default="cpu", description="cpu, cuda or cuda:N; cuda in fp16.")
    compiled: bool = Field(
        default=False, description="torch.compile: minutes at start, then faster frames."
    )
    warm_up_px: tuple[Pixels, Pixels] = Field(
        default=(640, 480), description="The camera's width and height, encoded once at start."
    )
    exported: Path | None = Field(
        default=None, description="ONNX of the vision tower, from 'onemap export-encoder'."
    )
    provider: Literal["cpu", "cuda", "tensorrt"] = Field(
        default="cpu", description="Where onnxruntime runs the exported tower."
    )


class TorchEncoderParams(TowerParams, ChannelParams):
    """What the encoders of vision and text towers in torch have in common."""

    former_keys: ClassVar[Mapping[str, str]] = {"kept_texts": "text_cache_size"}

    model: str = Field(
        description="A hub id that 'onemap models fetch' has fetched, or a file or folder."
    )
    allow_fetch: bool = Field(
        default=False, description="Fetch a missing model at start; off, a robot may be offline."
    )
    prompt: Prompt = Field(
        default="a {}", description="The paper's prompt; {} stands for the text of the query."
    )
    text_cache_size: int = Field(
        default=1024, ge=1, le=65536, description="Embeddings of texts kept: 3 MB at 768 numbers."
    )
    floor: float = Field(
        default=0.0,
        ge=0,
        lt=1,
        description="A query whose best score, (1 + cosine) / 2, is lower gets no region. 0: not "
        "measured, every query is answered; 'onemap bench queries --config' measures it.",
    )


class OpenClipConvNextParams(TorchEncoderParams):
    """OpenCLIP's ConvNeXt, the paper's encoder among them."""

    backend: Literal["openclip_convnext"] = Field(
        default="openclip_convnext",
        description="Chooses this encoder: the paper's, any word, a GPU is advised.",
    )
    architecture: str = Field(
        default="",
        description="open_clip's name or a JSON file; empty: open_clip_config.json beside it.",
    )
    long_side_px: int = Field(
        default=640, ge=32, le=2048, description="Pixels of the longer side fed in, shape kept."
    )
    sed_compat: bool = Field(
        default=False, description="The paper's fixed 768 x 768, which does not keep the shape."
    )


class Tipsv2Params(TorchEncoderParams):
    """TIPSv2 through transformers."""

    backend: Literal["tipsv2"] = Field(
        default="tipsv2",
        description="Chooses this encoder: any word, trained for features of single patches.",
    )
    long_side_px: int = Field(
        default=448, ge=14, le=2048, description="Pixels of the longer side fed in, shape kept."
    )


class RadioParams(TorchEncoderParams):
    """C-RADIO with its SigLIP2 adaptor."""

    backend: Literal["radio"] = Field(
        default="radio", description="Chooses this encoder: any word; needs allow_remote_code."
    )
    allow_remote_code: bool = Field(
        default=False,
        description="Run the Python that comes with the weights, which may use the network.",
    )
    long_side_px: int = Field(
        default=640, ge=16, le=2048, description="Pixels of the longer side fed in, shape kept."
    )


TorchParams = OpenClipConvNextParams | Tipsv2Params | RadioParams
EncoderParams = Annotated[MiniParams | TorchParams, Field(discriminator="backend")]
