"""Tiny random checkpoints in the layouts of the real ones."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import Any

import pytest
import torch

# Looks for the package only: importing it takes seconds, in every worker that collects tests.
needs_open_clip = pytest.mark.skipif(
    importlib.util.find_spec("open_clip") is None,
    reason="needs open_clip_torch (requirements/encoders.txt)",
)
EMBED_DIM = 16
OPEN_CLIP_CONFIG: dict[str, Any] = {
    "embed_dim": EMBED_DIM,
    "vision_cfg": {
        "timm_model_name": "test_convnext",
        "timm_model_pretrained": False,
        "timm_pool": "",
        "timm_proj": "mlp",
        "image_size": 64,
    },
    # The tokenizer's vocabulary; all else as small as it gets.
    "text_cfg": {
        "context_length": 77,
        "vocab_size": 49408,
        "width": 8,
        "heads": 1,
        "layers": 1,
    },
}
SED_PREFIX = "sem_seg_head.predictor.clip_model."
LAYOUTS = ("bare", "model", "sed")
LETTERS = {"<pad>": 0, "<unk>": 1, "▁": 2, **{chr(97 + i): 3 + i for i in range(26)}}  # TIPSv2's


def open_clip_model(seed: int = 0) -> Any:
    """open_clip's own model of the tiny architecture."""
    open_clip_model_module = pytest.importorskip("open_clip.model", reason="needs open_clip_torch")
    torch.manual_seed(seed)
    config = OPEN_CLIP_CONFIG
    return open_clip_model_module.CLIP(
        embed_dim=EMBED_DIM, vision_cfg=config["vision_cfg"], text_cfg=config["text_cfg"]
    ).eval()


def open_clip_folder(folder: Path, seed: int = 0) -> Path:
    """A folder as the hub lays it out."""
    from safetensors.torch import save_file

    folder.mkdir(parents=True, exist_ok=True)
    write_config(folder)
    weights = {
        name: value.contiguous() for name, value in open_clip_model(seed).state_dict().items()
    }
    save_file(weights, folder / "open_clip_model.safetensors")
    return folder


def open_clip_file(folder: Path, layout: str, *, without: str = "") -> Path:
    """A torch checkpoint in one of the LAYOUTS, its configuration beside it."""
    write_config(folder)
    weights = open_clip_model().state_dict()
    kept = {name: value for name, value in weights.items() if name != without}
    document: dict[str, Any]
    match layout:
        case "bare":
            document = kept
        case "model":
            document = {"model": kept, "iteration": 7}
        case _:
            decoder = {"sem_seg_head.predictor.transformer.decoder.weight": torch.zeros(3)}
            document = {"model": {SED_PREFIX + name: value for name, value in kept.items()}}
            document["model"].update(decoder)
    path = folder / f"{layout}.pth"
    torch.save(document, path)
    return path


def write_config(folder: Path) -> None:
    document = {"model_cfg": OPEN_CLIP_CONFIG, "preprocess_cfg": {}}
    (folder / "open_clip_config.json").write_text(json.dumps(document), encoding="utf-8")


def tipsv2_folder(folder: Path) -> Path:
    """A TIPSv2 model of two blocks and a tokenizer of a few letters."""
    transformers = pytest.importorskip("transformers", reason="needs transformers")
    if not hasattr(transformers, "Tipsv2Model"):
        pytest.skip(f"transformers {transformers.__version__} has no Tipsv2Model")
    torch.manual_seed(0)
    size = {"hidden_size": EMBED_DIM, "num_hidden_layers": 2, "num_attention_heads": 2}
    config = transformers.Tipsv2Config(
        vision_config={**size, "image_size": 56, "patch_size": 14},
        text_config={**size, "vocab_size": 64, "intermediate_size": 32},
    )
    transformers.Tipsv2Model(config).save_pretrained(folder)
    transformers.Tipsv2Tokenizer(vocab=LETTERS, merges=[]).save_pretrained(folder)
    return folder


def rtdetr_folder(folder: Path, names: tuple[str, ...] = ("chair", "couch", "tv")) -> Path:
    """An RT-DETRv2 of a few thousand weights of three names."""
    transformers = pytest.importorskip("transformers", reason="needs transformers")
    torch.manual_seed(0)
    backbone = transformers.RTDetrResNetConfig(
        embedding_size=8,
        hidden_sizes=[8, 8, 16, 16],
        depths=[1, 1, 1, 1],
        layer_type="basic",
        out_features=["stage2", "stage3", "stage4"],
    )
    config = transformers.RTDetrV2Config(
        backbone_config=backbone,
        encoder_in_channels=[8, 16, 16],
        encoder_hidden_dim=16,
        d_model=16,
        encoder_layers=1,
        encoder_ffn_dim=16,
        encoder_attention_heads=2,
        decoder_layers=2,
        decoder_ffn_dim=16,
        decoder_attention_heads=2,
        decoder_in_channels=[16, 16, 16],
        decoder_n_points=2,
        num_queries=20,
        num_denoising=0,
        id2label=dict(enumerate(names)),
        label2id={name: index for index, name in enumerate(names)},
    )
    transformers.RTDetrV2ForObjectDetection(config).save_pretrained(folder)
    return folder


def owl_folder(folder: Path) -> Path:
    """An OWLv2 of a few thousand weights with a tokenizer of single letters."""
    transformers = pytest.importorskip("transformers", reason="needs transformers")
    torch.manual_seed(0)
    size = {"hidden_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2}
    config = transformers.Owlv2Config(
        text_config={**size, "intermediate_size": 16, "vocab_size": 64, "bos_token_id": 62},
        vision_config={**size, "intermediate_size": 16, "image_size": 64, "patch_size": 16},
        projection_dim=16,
    )
    transformers.Owlv2ForObjectDetection(config).save_pretrained(folder)
    letters = {"!": 0, "<|startoftext|>": 62, "<|endoftext|>": 63}  # 0 means "no text" to OWLv2
    for index, letter in enumerate("abcdefghijklmnopqrstuvwxyz"):
        letters[letter], letters[letter + "</w>"] = 1 + index, 30 + index
    tokenizer = transformers.CLIPTokenizer(
        vocab=letters, merges=[], unk_token="<|endoftext|>", pad_token="<|endoftext|>"
    )
    images = transformers.Owlv2ImageProcessorPil(size={"height": 64, "width": 64})
    transformers.Owlv2Processor(images, tokenizer).save_pretrained(folder)
    return folder


def grounding_folder(folder: Path, kind: str) -> Path:
    """``MMGroundingDino``, LLMDet's class, or ``GroundingDino``: 0.3 million weights."""
    transformers = pytest.importorskip("transformers", reason="needs transformers")
    torch.manual_seed(0)
    words = ["[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", "."]
    for letter in "abcdefghijklmnopqrstuvwxyz":
        words += [letter, f"##{letter}"]
    config = getattr(transformers, f"{kind}Config")(
        backbone_config=transformers.SwinConfig(
            image_size=64,
            embed_dim=8,
            depths=[1, 1, 1, 1],
            num_heads=[1, 1, 2, 2],
            window_size=2,
            out_indices=[2, 3, 4],
        ),
        text_config=transformers.BertConfig(
            vocab_size=len(words),
            hidden_size=16,
            num_hidden_layers=1,
            num_attention_heads=2,
            intermediate_size=16,
        ),
        d_model=64,
        num_queries=9,
        encoder_layers=1,
        decoder_layers=2,
        encoder_attention_heads=2,
        decoder_attention_heads=2,
        encoder_ffn_dim=16,
        decoder_ffn_dim=16,
    )
    getattr(transformers, f"{kind}ForObjectDetection")(config).save_pretrained(folder)
    tokenizer = transformers.BertTokenizer(vocab={word: i for i, word in enumerate(words)})
    images = transformers.GroundingDinoImageProcessorPil(
        size={"shortest_edge": 96, "longest_edge": 128}
    )
    transformers.GroundingDinoProcessor(images, tokenizer).save_pretrained(folder)
    return folder
