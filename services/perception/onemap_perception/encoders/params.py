"""Parameters of the encoders: the section ``perception.encoder``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from onemap_perception.encoders.mini import MiniParams
from onemap_perception.encoders.projected import ChannelParams

Device = Annotated[str, Field(pattern=r"^(cpu|cuda(:\d+)?)$")]
LongSide = Annotated[
    int,
    Field(ge=14, le=2048, description="Pixels of the longer side fed in; the shape is kept."),
]


class TorchEncoderParams(ChannelParams):
    """What the encoders of vision and text towers in torch have in common."""

    model: str = Field(
        description="A hub id that 'onemap models fetch' has fetched, or a file or folder."
    )
    device: Device = Field(default="cpu", description="cpu, cuda or cuda:N; cuda in fp16.")
    exported: Path | None = Field(
        default=None, description="ONNX of the vision tower, from 'onemap export-encoder'."
    )
    provider: Literal["cpu", "cuda", "tensorrt"] = Field(
        default="cpu", description="Where onnxruntime runs the exported tower."
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
    long_side_px: LongSide = 640


class Tipsv2Params(TorchEncoderParams):
    """TIPSv2 through transformers."""

    backend: Literal["tipsv2"] = Field(
        default="tipsv2",
        description="Chooses this encoder: any word, trained for features of single patches.",
    )
    long_side_px: LongSide = 448


class RadioParams(TorchEncoderParams):
    """C-RADIO with its SigLIP2 adaptor."""

    backend: Literal["radio"] = Field(
        default="radio", description="Chooses this encoder: any word; needs allow_remote_code."
    )
    allow_remote_code: bool = Field(
        default=False,
        description="Run the Python that comes with the weights, which may use the network.",
    )
    long_side_px: LongSide = 640


TorchParams = OpenClipConvNextParams | Tipsv2Params | RadioParams
EncoderParams = Annotated[MiniParams | TorchParams, Field(discriminator="backend")]
