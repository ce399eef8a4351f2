"""The four steps of making the encoder: render, train, export, evaluate.

Each shows a progress bar. The work folder holds ``train``, ``calibrate``, ``held_out``,
``other_style`` and ``validation`` (frames) and ``run`` (checkpoint and log).
"""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from onemap_perception.encoders.checkpoint import open_device
from onemap_perception.encoders.mini import NETWORK_FILE, SHIPPED, MiniEncoder, MiniParams
from onemap_perception.text.calibration import CALIBRATION_FILE, Calibration, load_calibration
from onemap_perception.text.minilm import INSTALL, MiniLm, find_model_folder
from onemap_perception.text.text_encoder import EmbedTexts
from onemap_perception.text.vocabulary import VOCABULARY_FILE, Vocabulary, load_vocabulary
from onemap_simulator.generation.style import HELD_OUT
from onemap_tools.export.mini import compare_with_torch, export_network, write_embedding_table
from onemap_tools.export.onnx_file import MIN_COSINE
from onemap_tools.train.data.frame_dataset import (
    EVALUATION_SEEDS,
    NAMELESS,
    TRAIN_SEEDS,
    FrameDataset,
    FrameSetSpec,
    open_frames,
    render_frames,
)
from onemap_tools.train.data.text_targets import build_text_bank
from onemap_tools.train.evaluation.best_answers import best_answers
from onemap_tools.train.evaluation.calibration import DEFAULT_CALIBRATION, fit_temperature
from onemap_tools.train.evaluation.evaluate import evaluate
from onemap_tools.train.evaluation.model_card import model_card
from onemap_tools.train.evaluation.plots import draw_confusion, draw_reliability
from onemap_tools.train.network.backbone import INSTALL as INSTALL_BACKBONE
from onemap_tools.train.network.backbone import find_backbone_weights
from onemap_tools.train.network.mini_network import MiniNetwork
from onemap_tools.train.params import TrainParams
from onemap_tools.train.rounds import TRAINING_FILE, Rounds, read_rounds, write_rounds
from onemap_tools.train.train_state import load_averaged_network, read_checkpoint_rounds
from onemap_tools.train.trainer import TrainingProgress, train_mini
from onemap_tools.train.variety.kinds import VALIDATION, VARIED
from onemap_tools.train.variety.strangers import STRANGER

NOTES_FILE = "NOTES.md"  # on one particular training; the model card ends with it
TIMED_IMAGES = 50
COMPARED_IMAGES = 5  # between torch and ONNX
EVALUATION_TITLES = {
    "held_out": "held-out apartments",
    "other_style": "held-out style",
    "validation": "validation style",
}
VARIED_SHARE = 0.65  # of the apartments trained on; the rest are the simulator's own
MAX_BATCH_THREADS = 8  # beside a GPU; one keeps up with a CPU
# Of glibc's malloc.h.
M_TRIM_THRESHOLD, M_MMAP_MAX = -1, -4
UNLIMITED_BYTES = 2**31 - 1

ShowProgress = Callable[[int, str], None]


class TrainingError(Exception):
    """A step cannot be done; one sentence for the user."""


@dataclass(frozen=True, slots=True)
class TrainingFolders:
    """``work``: frames and checkpoints; ``output``: the encoder's files."""

    work: Path
    output: Path

    @property
    def vocabulary(self) -> Vocabulary:
        """The vocabulary in the output folder, else the shipped one."""
        own = (self.output / VOCABULARY_FILE).exists()
        return load_vocabulary(self.output if own else SHIPPED)


def frame_sets(apartments: int, per_apartment: int) -> dict[str, FrameSetSpec]:
    """The frames to render, by folder. No seed occurs in two of them.

    The validation style is neither trained on nor reported as a held-out style: the temperature
    is fitted on some of its apartments, other trainings are compared by the rest.
    """
    seeds = EVALUATION_SEEDS
    return {
        "held_out": FrameSetSpec(tuple(seeds[:30]), 20),
        "other_style": FrameSetSpec(tuple(seeds[30:60]), 20, style=HELD_OUT),
        "calibrate": FrameSetSpec(tuple(seeds[60:75]), 20, variety=VALIDATION),
        "validation": FrameSetSpec(tuple(seeds[75:90]), 20, variety=VALIDATION),
        "train": FrameSetSpec(
            tuple(TRAIN_SEEDS[:apartments]),
            per_apartment,
            variety=VARIED,
            varied_share=VARIED_SHARE,
        ),
    }


def find_pretrained() -> tuple[Path, EmbedTexts]:
    """The backbone's checkpoint and the sentence encoder that training starts from.

    Raises:
        TrainingError: one of them is not installed; says how to install it.
    """
    sentence_encoder = _open_sentence_encoder()
    weights = find_backbone_weights()
    if weights is None:
        raise TrainingError(f"the backbone's pretrained weights are missing: {INSTALL_BACKBONE}")
    return weights, sentence_encoder


def render(folders: TrainingFolders, apartments: int, per_apartment: int, processes: int) -> None:
    """Render all frames; continues an interrupted rendering."""
    names = check_vocabulary(folders.vocabulary).names
    for name, spec in frame_sets(apartments, per_apartment).items():
        with _progress_bar(f"rendering {name}", spec.count) as show:
            for done in render_frames(folders.work / name, names, spec, processes):
                show(done, "")


def check_vocabulary(vocabulary: Vocabulary) -> Vocabulary:
    """The vocabulary; TrainingError where a training with it cannot work."""
    known = set(load_vocabulary(SHIPPED).names)
    if unknown := [name for name in vocabulary.names if name not in known]:
        raise TrainingError(
            f"{VOCABULARY_FILE}: the simulator draws nothing of the class {unknown[0]!r}: name "
            "classes as the shipped one does, and put other words for them into 'aliases'"
        )
    if bare := [entry.name for entry in vocabulary.classes if not entry.aliases]:
        raise TrainingError(
            f"{VOCABULARY_FILE}: the class {bare[0]!r} has no aliases: list at least its name"
        )
    if not any(entry.held_out for entry in vocabulary.classes):
        raise TrainingError(
            f"{VOCABULARY_FILE}: no class has a word in 'held_out', by which synonyms are "
            "evaluated: add one"
        )
    return vocabulary


def train(folders: TrainingFolders, params: TrainParams, device: str, threads: int) -> None:
    """Train on the rendered frames; continues from the checkpoint.

    ``device``: auto means CUDA if there is a device.
    """
    frames = _open_frames(folders, "train")
    weights, sentence_encoder = find_pretrained()
    bank = build_text_bank(folders.vocabulary, sentence_encoder)
    keep_freed_memory()
    torch.set_num_threads(threads)
    chosen = choose_device(device)
    ahead = 1 if chosen.type == "cpu" else min(os.cpu_count() or 1, MAX_BATCH_THREADS)
    with _progress_bar("training", params.total_steps) as show:

        def report(progress: TrainingProgress) -> None:
            show(progress.step, f"loss {progress.loss:.3f}")

        train_mini(
            frames,
            bank,
            folders.work / "run",
            params=params.model_copy(update={"backbone_weights": weights, "batch_threads": ahead}),
            device=chosen,
            report=report,
        )


def choose_device(device: str) -> torch.device:
    """The device; auto: CUDA where there is one. BackendError if it cannot be used."""
    automatic = "cuda" if torch.cuda.is_available() else "cpu"
    return open_device(automatic if device == "auto" else device)


def keep_freed_memory() -> bool:
    """Make malloc keep freed memory for the next step; returns whether the C library can.

    By default glibc returns large arrays to the kernel, and every step faults their pages in
    again.
    """
    if sys.platform != "linux":
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # musl has none
    return mallopt is not None and bool(
        mallopt(M_MMAP_MAX, 0) and mallopt(M_TRIM_THRESHOLD, UNLIMITED_BYTES)
    )


@dataclass(frozen=True, slots=True)
class ExportReport:
    """Least cosine of a patch to torch; the floor of the weights before, which does not hold."""

    least_cosine: float
    dropped_floor: float


def export(folders: TrainingFolders) -> ExportReport:
    """Write weights, embedding table, calibration and what they were trained with.

    All of them or, where a step fails, none: an encoder that was there stays as it was.
    """
    run, output = folders.work / "run", folders.output
    network, rounds = load_averaged_network(run), read_checkpoint_rounds(run)
    frames = _open_frames(folders, "calibrate")
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output, prefix=".export-") as name:
        made = Path(name)
        own = (output / VOCABULARY_FILE).exists()
        shutil.copy((output if own else SHIPPED) / VOCABULARY_FILE, made)
        path = export_network(network, made)
        cosine = compare_with_torch(network, path, np.asarray(frames.rgb[:COMPARED_IMAGES]))
        if not cosine >= MIN_COSINE:  # also if it is NaN
            raise TrainingError(
                f"the exported network differs from torch: least cosine {cosine:.5f}"
            )
        write_embedding_table(folders.vocabulary, _open_sentence_encoder(), made)
        before = floor_of(output)
        same = before > 0 and (output / NETWORK_FILE).read_bytes() == path.read_bytes()
        save_calibration(made, replace(DEFAULT_CALIBRATION, floor=before if same else 0.0))
        _fit_temperature(made, frames)
        write_rounds(made, rounds)
        for file in made.iterdir():
            file.replace(output / file.name)
    return ExportReport(cosine, 0.0 if same else before)


def floor_of(folder: Path) -> float:
    """The floor of an exported encoder, 0 where it has none."""
    return load_calibration(folder).floor if (folder / CALIBRATION_FILE).exists() else 0.0


def _fit_temperature(folder: Path, frames: FrameDataset) -> None:
    """Replace the temperature of an encoder's calibration by the one that fits the frames."""
    encoder, calibration = MiniEncoder(MiniParams(folder=folder)), load_calibration(folder)
    names = encoder.embed_text(load_vocabulary(folder).names)
    temperature = fit_temperature(encoder, names, frames, np.random.default_rng(0))
    save_calibration(folder, replace(calibration, temperature=round(temperature, 2)))


def save_calibration(folder: Path, calibration: Calibration) -> None:
    """Write ``calibration.json``."""
    text = json.dumps(asdict(calibration), indent=2) + "\n"
    (folder / CALIBRATION_FILE).write_text(text, encoding="utf-8")


def evaluate_encoder(folders: TrainingFolders) -> dict[str, Any]:
    """Figures on held-out apartments, the held-out style and the validation style, and facts.

    Held-out synonyms are embedded even where a query would resolve them as an alias.
    """
    encoder = MiniEncoder(MiniParams(folder=folders.output), aliases=False)
    result: dict[str, Any] = {
        "encoder_id": encoder.encoder_id,
        "facts": _measure_facts(folders, encoder),
    }
    for name in EVALUATION_TITLES:
        frames = _open_frames(folders, name)
        with _progress_bar(f"evaluating {name}", 2 * len(frames)) as show:

            def progress(done: int, show: ShowProgress = show) -> None:
                show(done, "")

            result[name] = _figures(encoder, folders.vocabulary, frames, progress)
    return result


def _figures(
    encoder: MiniEncoder, vocabulary: Vocabulary, frames: FrameDataset, show: Callable[[int], None]
) -> dict[str, Any]:
    """The figures of a set, and the trust in the best answers, also about nameless things."""
    figures = evaluate(encoder, vocabulary, frames, show)
    nameless = len(vocabulary.names)
    pairs = [
        (rgb, np.where(label == NAMELESS, np.uint8(nameless), label))
        for rgb, label in zip(frames.rgb, frames.label, strict=True)
    ]
    shown = len(frames)
    figures["best_answer"] = best_answers(
        encoder, vocabulary.names, pairs, lambda done: show(shown + done), (STRANGER,)
    )
    return figures


def training_rounds(folders: TrainingFolders) -> Rounds:
    """What the exported weights were trained with; TrainingError where that is not known."""
    rounds = read_rounds(folders.output)
    if not rounds:
        raise TrainingError(
            f"{folders.output} has no {TRAINING_FILE}, from which the card says what it was "
            "trained with: export it with 'onemap train export'"
        )
    return rounds


def write_card(folders: TrainingFolders, figures: dict[str, Any]) -> Path:
    """Write ``MODEL_CARD.md`` and its plots beside the weights."""
    path, notes = folders.output / "MODEL_CARD.md", folders.output / NOTES_FILE
    text = notes.read_text(encoding="utf-8") if notes.exists() else ""
    card = model_card(figures, training_rounds(folders), text)
    path.write_text(card.rstrip() + "\n", encoding="utf-8")
    draw_confusion(figures["held_out"], folders.output)
    parts = {title: figures[name] for name, title in EVALUATION_TITLES.items()}
    draw_reliability(parts, folders.output)
    return path


def _measure_facts(folders: TrainingFolders, encoder: MiniEncoder) -> dict[str, float]:
    vocabulary = folders.vocabulary
    rgb = np.asarray(_open_frames(folders, "held_out").rgb[0])
    times_ms: list[float] = []
    for _ in range(TIMED_IMAGES):
        started_s = time.perf_counter()
        encoder.encode(rgb)
        times_ms.append((time.perf_counter() - started_s) * 1e3)
    return {
        "parameters": sum(p.numel() for p in MiniNetwork().parameters()) / 1e6,
        "encode_ms": float(np.median(times_ms)),
        "words": len(vocabulary.words),
        "neutral": len(vocabulary.neutral),
        "temperature": encoder.embed_text(vocabulary.names[:1]).temperature,
    }


def _open_frames(folders: TrainingFolders, name: str) -> FrameDataset:
    """The frames of a set, whose labels are indices into the vocabulary's classes."""
    try:
        frames = open_frames(folders.work / name)
    except FileNotFoundError as problem:
        raise TrainingError(str(problem)) from problem
    if frames.classes != folders.vocabulary.names:
        raise TrainingError(
            f"the pictures in {folders.work / name} were rendered for other classes than those of "
            f"{folders.output}: give the --output they were rendered with, or another --work"
        )
    return frames


def _open_sentence_encoder() -> EmbedTexts:
    folder = find_model_folder()
    if folder is None:
        raise TrainingError(f"training needs the sentence encoder: {INSTALL}")
    return MiniLm(folder).embed


@contextmanager
def _progress_bar(title: str, total: int) -> Iterator[ShowProgress]:
    """A progress bar on the terminal; yields a function of (done, note)."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns) as progress:
        task = progress.add_task(title, total=total, note="")
        yield lambda done, note: progress.update(task, completed=done, note=note)
