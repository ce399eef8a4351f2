"""Encoders of other people's models against the libraries' own code, on the same random weights.

``python -m tests.perception.library_paths`` compares at full size, which needs up to 7 GB and
minutes; a test does at reduced depth and width. The reference is what the library's documentation
says to call, from reading the folder on. Features of single patches have no such call: there the
library's own modules run, of OpenCLIP the head on each location (and the whole model on an image
of one cell), of TIPSv2 the last block with a mask by which each token attends to itself alone.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from onemap_perception.config import OpenClipConvNextParams, Tipsv2Params
from onemap_perception.encoders.openclip_convnext import STRIDE
from onemap_perception.encoders.torch_encoder import PROMPT, TorchEncoder
from onemap_perception.errors import import_torchvision
from onemap_perception.factory import make_encoder
from onemap_shared.geometry import F32, U8
from tests.perception.tiny import LETTERS

WORDS = ("sofa", "Red Chair", "café table, round", "tv", "what stands beside the bed " * 20)
TIPS_SIZES: Mapping[str, dict[str, int]] = {  # of the vision tower; both towers are as wide
    "b14": {"hidden_size": 768, "num_hidden_layers": 12, "num_attention_heads": 12},
    "l14": {"hidden_size": 1024, "num_hidden_layers": 24, "num_attention_heads": 16},
}


@dataclass(frozen=True, slots=True)
class Agreement:
    """pixels: the largest difference of the towers' inputs; patches, texts: the lowest cosine;
    spread: the highest between two different texts or patches of the reference."""

    pixels: float
    patches: float
    texts: float
    spread: float


def randomised(model: torch.nn.Module, seed: int = 0) -> Any:
    """The model with noise on every parameter: biases and layer scales start as good as absent."""
    generator = torch.Generator().manual_seed(seed)
    for parameter in model.parameters():
        std = 0.02 if parameter.ndim > 1 else 0.1
        parameter.data += std * torch.randn(parameter.shape, generator=generator)
    return model.eval().requires_grad_(False)


def camera_image(width: int, height: int) -> U8:
    """Coarse noise and fine noise, (height, width, 3)."""
    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 200, (height // 16 + 1, width // 16 + 1, 3))
    image = coarse.repeat(16, 0).repeat(16, 1)[:height, :width]
    return (image + rng.integers(0, 56, image.shape)).astype(np.uint8)


def unit(rows: torch.Tensor) -> F32:
    """Unit rows (N, D) of features (..., D)."""
    normalised: F32 = torch.nn.functional.normalize(rows.float(), dim=-1).flatten(0, -2).numpy()
    return normalised


def lowest_cosine(ours: Any, reference: F32) -> float:
    """Of rows (..., D) with reference rows (N, D), both of unit length."""
    rows = np.asarray(ours, np.float64).reshape(reference.shape)
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    return float((rows * reference).sum(1).min())


def spread_of(*references: F32) -> float:
    """The highest cosine between two different rows of one array."""
    products = [rows[:200] @ rows[:200].T for rows in references]
    return float(max((each - 2 * np.eye(len(each))).max() for each in products))


def openclip_folder(
    folder: Path,
    architecture: str,
    changes: Mapping[str, Mapping[str, Any]] | None = None,
    preprocess: Mapping[str, Any] | None = None,
    **options: Any,
) -> Path:
    """open_clip's architecture with random weights, as the hub lays it out.

    changes: other values of vision_cfg and text_cfg; options: other keys of the architecture.
    """
    import open_clip
    from safetensors.torch import save_file

    config = {**deepcopy(open_clip.get_model_config(architecture)), **options}
    for part, values in (changes or {}).items():
        config[part].update(values)
    model = randomised(open_clip.model.CLIP(**config))
    save_file(
        {name: value.contiguous() for name, value in model.state_dict().items()},
        folder / "open_clip_model.safetensors",
    )
    document = {"model_cfg": config, "preprocess_cfg": preprocess or {}}
    (folder / "open_clip_config.json").write_text(json.dumps(document), encoding="utf-8")
    return folder


def compare_openclip(folder: Path) -> Agreement:
    """Ours and ``open_clip.create_model_and_transforms`` on the folder."""
    import open_clip

    created: Any = open_clip.create_model_and_transforms(f"local-dir:{folder}")
    model, _, preprocess = created
    tokenizer = open_clip.get_tokenizer(f"local-dir:{folder}")
    model.eval()
    side = model.visual.image_size[0]
    encoder = make_encoder(OpenClipConvNextParams(model=str(folder), long_side_px=side))
    assert isinstance(encoder, TorchEncoder)
    rgb = camera_image(side, side)
    with torch.inference_mode():
        image = preprocess(Image.fromarray(rgb))[None]
        trunk, head = model.visual.trunk, model.visual.head
        (last,) = trunk.forward_intermediates(image, indices=1, intermediates_only=True)
        locations = last.permute(0, 2, 3, 1).flatten(0, 2)[:, :, None, None]
        patches = unit(head(trunk.forward_head(locations)))
        one_cell = image[..., :STRIDE, :STRIDE]
        pooled = unit(model.encode_image(one_cell))
        texts = unit(model.encode_text(tokenizer([PROMPT.format(word) for word in WORDS])))
    return Agreement(
        float(np.abs(encoder.prepare(rgb) - image.numpy()).max()),
        min(
            lowest_cosine(encoder.encode(rgb), patches),
            lowest_cosine(encoder.tower(one_cell.numpy()), pooled),
        ),
        lowest_cosine(encoder.embed_text(WORDS).embeddings, texts),
        spread_of(patches, texts),
    )


def tipsv2_folder(folder: Path, size: Mapping[str, int], text_layers: int = 12) -> Path:
    """TIPSv2 with random weights, its processor of images, and a tokenizer of letters."""
    import transformers

    text = {**size, "num_hidden_layers": text_layers, "intermediate_size": 4 * size["hidden_size"]}
    config = transformers.Tipsv2Config(vision_config=dict(size), text_config=text)
    randomised(transformers.Tipsv2Model(config)).save_pretrained(folder)
    tokenizer = transformers.Tipsv2Tokenizer(vocab=LETTERS, merges=[])
    transformers.Tipsv2Processor(transformers.Tipsv2ImageProcessor(), tokenizer).save_pretrained(
        folder
    )
    return folder


def compare_tipsv2(folder: Path) -> Agreement:
    """Ours and transformers' AutoModel and AutoProcessor on the folder."""
    from transformers import AutoModel, AutoProcessor

    model = AutoModel.from_pretrained(folder, local_files_only=True).eval()
    processor = AutoProcessor.from_pretrained(folder, local_files_only=True)
    side = processor.image_processor.size["height"]
    encoder = make_encoder(Tipsv2Params(model=str(folder), long_side_px=side))
    assert isinstance(encoder, TorchEncoder)
    rgb = camera_image(side, side)
    prompts = [PROMPT.format(word) for word in WORDS]
    with torch.inference_mode():
        image = processor(images=Image.fromarray(rgb), return_tensors="pt").pixel_values
        oblong = image[..., : side // 4 * 3, :]
        texts = unit(
            model.get_text_features(**processor(text=prompts, return_tensors="pt")).pooler_output
        )
        patches = [own_attention(model.vision_model, each) for each in (image, oblong)]
    ours = [encoder.tower(each.numpy()) for each in (image, oblong)]
    return Agreement(
        float(np.abs(encoder.prepare(rgb) - image.numpy()).max()),
        min(lowest_cosine(mine, theirs) for mine, theirs in zip(ours, patches, strict=True)),
        lowest_cosine(encoder.embed_text(WORDS).embeddings, texts),
        spread_of(patches[0], texts),
    )


def own_attention(vision: Any, image: torch.Tensor) -> F32:
    """Unit features (N, D) of the patches; in the last block each token sees itself alone."""
    states = vision(image, output_hidden_states=True).hidden_states
    tokens = states[-2].shape[1]
    mask = torch.full((1, 1, tokens, tokens), -torch.inf).masked_fill(
        torch.eye(tokens, dtype=torch.bool), 0.0
    )
    last = vision.encoder.layer[-1](states[-2], attention_mask=mask)
    return unit(vision.layernorm(last)[:, 1 + vision.config.num_register_tokens :])


FULL: Mapping[str, tuple[Callable[[Path], Path], Callable[[Path], Agreement]]] = {
    **{
        name: (partial(openclip_folder, architecture=name), compare_openclip)
        for name in ("convnext_base_w", "convnext_large_d_320")
    },
    **{
        f"tipsv2-{name}": (partial(tipsv2_folder, size=size), compare_tipsv2)
        for name, size in TIPS_SIZES.items()
    },
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each model."""
    import_torchvision()
    parser = argparse.ArgumentParser(description="Compare at full size, with random weights.")
    parser.add_argument("model", nargs="*", default=list(FULL), help=", ".join(FULL))
    for name in parser.parse_args(arguments).model:
        make, compare = FULL[name]
        begun = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            agreement = compare(make(Path(folder)))
        print(name, agreement, f"{time.monotonic() - begun:.0f} s", flush=True)


if __name__ == "__main__":
    main()
