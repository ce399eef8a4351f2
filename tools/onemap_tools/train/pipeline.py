"""The steps of making the encoder: render, train, export; and its evaluation.

Each shows a progress bar. The work folder holds ``train``, ``calibrate``, ``held_out`` and
``other_style`` (frames) and ``run`` (checkpoint and log).
"""

from __future__ import annotations

import ctypes
import json
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from onemap_perception.config import SHIPPED, MiniParams
from onemap_perception.encoders.checkpoint import open_device
from onemap_perception.encoders.mini import MiniEncoder
from onemap_perception.text.embeddings import EmbedTexts
from onemap_perception.text.minilm import INSTALL, MiniLm, find_model_folder
from onemap_perception.text.vocabulary import (
    CALIBRATION_FILE,
    VOCABULARY_FILE,
    Calibration,
    load_vocabulary,
)
from onemap_simulator.generation.style import HELD_OUT
from onemap_tools.train.batches import TrainParams, build_text_bank
from onemap_tools.train.evaluation import (
    DEFAULT_CALIBRATION,
    EVALUATION_SETS,
    evaluate,
    fit_temperature,
)
from onemap_tools.train.export import (
    MIN_COSINE,
    compare_with_torch,
    export_network,
    write_embedding_table,
)
from onemap_tools.train.frames import (
    EVALUATION_SEEDS,
    TRAIN_SEEDS,
    FrameSetSpec,
    open_frames,
    render_frames,
)
from onemap_tools.train.network import INSTALL as INSTALL_BACKBONE
from onemap_tools.train.network import find_backbone_weights
from onemap_tools.train.trainer import (
    load_averaged_network,
    train_mini,
)

TRAINING_FILE = "training.json"  # beside the weights: what they were trained with
COMPARED_IMAGES = 5  # between torch and ONNX
# Of glibc's malloc.h.
M_TRIM_THRESHOLD, M_MMAP_MAX = -1, -4
UNLIMITED_BYTES = 2**31 - 1


def frame_sets(apartments: int) -> dict[str, FrameSetSpec]:
    """The frames to render, by folder. No seed occurs in two of them."""
    return {
        "held_out": FrameSetSpec(tuple(EVALUATION_SEEDS[:30])),
        "other_style": FrameSetSpec(tuple(EVALUATION_SEEDS[30:60]), style=HELD_OUT),
        "calibrate": FrameSetSpec(tuple(EVALUATION_SEEDS[60:75])),
        "train": FrameSetSpec(tuple(TRAIN_SEEDS[:apartments])),
    }


def find_pretrained() -> tuple[Path, EmbedTexts]:
    """The backbone's checkpoint and the sentence encoder that training starts from.

    Raises:
        ValueError: one of them is not installed; says how to install it.
    """
    sentence_encoder = _open_sentence_encoder()
    weights = find_backbone_weights()
    if weights is None:
        raise ValueError(f"the backbone's pretrained weights are missing: {INSTALL_BACKBONE}")
    return weights, sentence_encoder


def render(work: Path, apartments: int, processes: int) -> None:
    """Render all frames; continues an interrupted rendering."""
    names = load_vocabulary(SHIPPED).names
    for name, spec in frame_sets(apartments).items():
        with _progress_bar(f"rendering {name}", spec.count) as show:
            for done in render_frames(work / name, names, spec, processes):
                show(done)


def train(work: Path, params: TrainParams, device: str, threads: int) -> None:
    """Train on the rendered frames; continues from the checkpoint.

    ``device``: auto means CUDA if there is a device.
    """
    frames = open_frames(work / "train")
    weights, sentence_encoder = find_pretrained()
    bank = build_text_bank(load_vocabulary(SHIPPED), sentence_encoder)
    if sys.platform == "linux":
        keep_freed_memory()
    torch.set_num_threads(threads)
    chosen = choose_device(device)
    with _progress_bar("training", params.total_steps) as show:
        train_mini(
            frames,
            bank,
            work / "run",
            params=replace(params, backbone_weights=weights),
            device=chosen,
            report=lambda step, loss: show(step, f"loss {loss:.3f}"),
        )


def choose_device(device: str) -> torch.device:
    """The device; auto: CUDA where there is one. BackendError if it cannot be used."""
    automatic = "cuda" if torch.cuda.is_available() else "cpu"
    return open_device(automatic if device == "auto" else device)


def keep_freed_memory() -> None:
    """Make glibc's malloc keep freed memory for the next step.

    By default it returns large arrays to the kernel, and every step faults their pages in again.
    """
    if mallopt := getattr(ctypes.CDLL(None), "mallopt", None):  # musl has none
        mallopt(M_MMAP_MAX, 0)
        mallopt(M_TRIM_THRESHOLD, UNLIMITED_BYTES)


def export(work: Path, output: Path) -> float:
    """Write weights, embedding table, calibration and what they were trained with to ``output``.

    All of them or, where a step fails, none: an encoder that was there stays as it was. Returns
    the least cosine of a patch to torch.
    """
    network, record = load_averaged_network(work / "run")
    frames = open_frames(work / "calibrate")
    compared = np.stack([frames[i][0] for i in range(min(COMPARED_IMAGES, len(frames)))])
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output, prefix=".export-") as name:
        made = Path(name)
        shutil.copy(SHIPPED / VOCABULARY_FILE, made)
        path = export_network(network, made)
        cosine = compare_with_torch(network, path, compared)
        if not cosine >= MIN_COSINE:  # also if it is NaN
            raise ValueError(f"the exported network differs from torch: least cosine {cosine:.5f}")
        write_embedding_table(load_vocabulary(SHIPPED), _open_sentence_encoder(), made)
        _save(DEFAULT_CALIBRATION, made)
        encoder = MiniEncoder(MiniParams(folder=made))
        names = encoder.embed_text(load_vocabulary(made).names)
        temperature = fit_temperature(encoder, names, frames, np.random.default_rng(0))
        _save(replace(DEFAULT_CALIBRATION, temperature=round(temperature, 2)), made)
        (made / TRAINING_FILE).write_text(json.dumps(asdict(record)) + "\n", encoding="utf-8")
        for file in made.iterdir():
            file.replace(output / file.name)
    return cosine


def _save(calibration: Calibration, folder: Path) -> None:
    """Write ``calibration.json``."""
    text = json.dumps(asdict(calibration), indent=2) + "\n"
    (folder / CALIBRATION_FILE).write_text(text, encoding="utf-8")


def evaluate_encoder(work: Path, output: Path) -> dict[str, Any]:
    """Figures on held-out apartments and on the simulator's held-out style.

    Held-out synonyms are embedded even where a query would resolve them as an alias.
    """
    encoder = MiniEncoder(MiniParams(folder=output), raw=True)
    result: dict[str, Any] = {"encoder_id": encoder.encoder_id}
    for name in EVALUATION_SETS:
        frames = open_frames(work / name)
        with _progress_bar(f"evaluating {name}", len(frames)) as show:
            result[name] = evaluate(encoder, load_vocabulary(output), frames, show)
    return result


def _open_sentence_encoder() -> EmbedTexts:
    folder = find_model_folder()
    if folder is None:
        raise ValueError(f"training needs the sentence encoder: {INSTALL}")
    return MiniLm(folder).embed


@contextmanager
def _progress_bar(title: str, total: int) -> Iterator[Callable[..., None]]:
    """A progress bar on the terminal; yields a function of (done, note)."""
    note_column = TextColumn("{task.fields[note]}")
    title_column = TextColumn("{task.description}")
    columns = (title_column, BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), note_column)
    with Progress(*columns) as progress:
        task = progress.add_task(title, total=total, note="")
        yield lambda done, note="": progress.update(task, completed=done, note=note)
