"""``perception.encoder``: which one, and its own settings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from onemap_perception.encoders.mini import SHIPPED, MiniSettings
from onemap_shared.params import Params

Device = Annotated[str, Field(pattern=r"^(cpu|cuda(:\d+)?)$")]
Prompt = Annotated[str, Field(pattern=r"^[^{}]*\{\}[^{}]*$")]
Pixels = Annotated[int, Field(ge=1, le=8192)]


class MiniParams(Params):
    """The encoder that ships with OneMap."""

    backend: Literal["mini"] = Field(
        default="mini", description="Chooses this encoder: it ships with OneMap and needs no GPU."
    )
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
        description="Wider images are reduced to this: what the network was trained on.",
    )

    def settings(self) -> MiniSettings:
        """As the encoder reads them."""
        return MiniSettings(self.folder, self.threads, self.input_width_px)


class TorchEncoderParams(Params):
    """What the encoders of other people have in common."""

    model: str = Field(
        description="A hub id that 'onemap models fetch' has fetched, or a file or folder."
    )
    allow_fetch: bool = Field(
        default=False, description="Fetch a missing model at start; off, a robot may be offline."
    )
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
    prompt: Prompt = Field(default="a {}", description="The paper's; {} is what was asked for.")
    kept_texts: int = Field(
        default=1024, ge=1, le=65536, description="Newest embeddings kept: 3 MB at 768 numbers."
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
        description="Chooses this encoder: the paper's, any word, a GPU is advised."
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
        description="Chooses this encoder: any word, trained for features of single patches."
    )
    long_side_px: int = Field(
        default=448, ge=14, le=2048, description="Pixels of the longer side fed in, shape kept."
    )


class RadioParams(TorchEncoderParams):
    """C-RADIO with its SigLIP2 adaptor."""

    backend: Literal["radio"] = Field(
        description="Chooses this encoder: any word; needs allow_remote_code."
    )
    allow_remote_code: bool = Field(
        default=False,
        description="Run the Python that comes with the weights, which may use the network.",
    )
    long_side_px: int = Field(
        default=640, ge=16, le=2048, description="Pixels of the longer side fed in, shape kept."
    )


EncoderParams = Annotated[
    MiniParams | OpenClipConvNextParams | Tipsv2Params | RadioParams,
    Field(discriminator="backend"),
]
