"""The four steps from nothing to the shipped encoder, with a progress bar each.

Everything lies under one work folder: ``train``, ``calibrate``, ``held_out`` and
``other_style`` (frames), ``run`` (checkpoint and log).
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from onemap_perception.encoders.mini import SHIPPED, MiniEncoder, MiniParams
from onemap_perception.text.calibration import CALIBRATION_FILE, Calibration
from onemap_perception.text.minilm import INSTALL, MiniLm, find_model_folder
from onemap_perception.text.vocabulary import VOCABULARY_FILE, Vocabulary, load_vocabulary
from onemap_simulator.generation.style import HELD_OUT
from onemap_tools.export.mini import MIN_COSINE, export_network, least_cosine, write_embedding_table
from onemap_tools.train.data.frame_dataset import (
    EVALUATION_SEEDS,
    TRAIN_SEEDS,
    FrameDataset,
    FrameSetParams,
    open_frames,
    render_frames,
)
from onemap_tools.train.data.text_targets import TextEmbedder, build_text_bank
from onemap_tools.train.evaluation.calibration import DEFAULT_CALIBRATION, fit_temperature
from onemap_tools.train.evaluation.evaluate import evaluate
from onemap_tools.train.evaluation.model_card import model_card
from onemap_tools.train.evaluation.plots import draw_confusion, draw_reliability
from onemap_tools.train.network.backbone import INSTALL as INSTALL_TRUNK
from onemap_tools.train.network.backbone import find_backbone_weights
from onemap_tools.train.network.mini_network import MiniNetwork
from onemap_tools.train.trainer import TrainingProgress, TrainParams, load_average, train_mini

NOTES_FILE = "NOTES.md"  # of whoever trained; goes into the card
TIMED_IMAGES = 50
SHORT = {"held_out": "held-out apartments", "other_style": "held-out style"}
COMPARED_IMAGES = 5  # compared between torch and ONNX before anything ships


class TrainingError(Exception):
    """A step cannot be done; one sentence for the user."""


@dataclass(frozen=True, slots=True)
class TrainingFolders:
    """Where frames and checkpoints lie, and where the encoder's files go."""

    folder: Path
    output: Path

    @property
    def vocabulary(self) -> Vocabulary:
        """The words to train: those that lie where the encoder goes, else the shipped ones."""
        own = (self.output / VOCABULARY_FILE).exists()
        return load_vocabulary(self.output if own else SHIPPED)


def frame_plans(apartments: int, per_apartment: int) -> dict[str, FrameSetParams]:
    """What is rendered, by folder. No seed and no view occurs in two of them."""
    trained = tuple(TRAIN_SEEDS[:apartments])
    return {
        "held_out": FrameSetParams(tuple(EVALUATION_SEEDS[:30]), 20),
        "other_style": FrameSetParams(tuple(EVALUATION_SEEDS[30:60]), 20, style=HELD_OUT),
        "calibrate": FrameSetParams(tuple(EVALUATION_SEEDS[60:75]), 20),
        "train": FrameSetParams(trained, per_apartment),
    }


def render(work: TrainingFolders, apartments: int, per_apartment: int, processes: int) -> None:
    """Render all frames; goes on where it stopped."""
    names = work.vocabulary.names
    for name, plan in frame_plans(apartments, per_apartment).items():
        with _progress_bar(f"rendering {name}", plan.count) as show:
            for done in render_frames(work.folder / name, names, plan, processes):
                show(done, "")


def train(work: TrainingFolders, settings: TrainParams, device: torch.device) -> None:
    """Train on the rendered frames; goes on from the checkpoint."""
    frames = _open_frames(work, "train")
    bank = build_text_bank(work.vocabulary, _open_sentence_encoder())
    trunk = find_backbone_weights()
    if trunk is None:
        raise TrainingError(f"training begins with weights that are missing: {INSTALL_TRUNK}")
    with _progress_bar("training", settings.total) as show:

        def report(state: TrainingProgress) -> None:
            show(state.step, f"loss {state.loss:.3f}")

        settings = replace(settings, trunk=trunk)
        train_mini(
            frames, bank, work.folder / "run", settings=settings, device=device, report=report
        )


def export(work: TrainingFolders) -> float:
    """Write weights, word table and calibration; returns the least cosine to torch."""
    work.output.mkdir(parents=True, exist_ok=True)
    if not (work.output / VOCABULARY_FILE).exists():
        shutil.copy(SHIPPED / VOCABULARY_FILE, work.output)
    network = load_average(work.folder / "run")
    path = export_network(network, work.output)
    frames = _open_frames(work, "calibrate")
    cosine = least_cosine(network, path, np.asarray(frames.rgb[:COMPARED_IMAGES]))
    if cosine < MIN_COSINE:
        raise TrainingError(f"the exported network departs from torch: least cosine {cosine:.5f}")
    write_embedding_table(work.vocabulary, _open_sentence_encoder(), work.output)
    _save_calibration(work.output, DEFAULT_CALIBRATION)
    encoder = MiniEncoder(MiniParams(folder=work.output))
    names = encoder.embed_text(work.vocabulary.names)
    rng = np.random.default_rng(0)
    temperature = fit_temperature(encoder, names, frames, rng)
    _save_calibration(work.output, replace(DEFAULT_CALIBRATION, temperature=round(temperature, 2)))
    return cosine


def evaluate_encoder(work: TrainingFolders) -> dict[str, Any]:
    """Figures on held-out apartments and on the simulator's held-out style, and plain facts.

    Held-out synonyms are embedded even where a query would take them for an alias.
    """
    encoder = MiniEncoder(MiniParams(folder=work.output), aliases=False)
    result: dict[str, Any] = {
        "encoder_id": encoder.encoder_id,
        "facts": _measure_facts(work, encoder),
    }
    for name in ("held_out", "other_style"):
        frames = _open_frames(work, name)
        with _progress_bar(f"evaluating {name}", len(frames)) as show:

            def progress(done: int, show: Callable[[int, str], None] = show) -> None:
                show(done, "")

            result[name] = evaluate(encoder, work.vocabulary, frames, progress)
    return result


def write_card(work: TrainingFolders, figures: dict[str, Any]) -> Path:
    """Write ``MODEL_CARD.md`` and its pictures beside the weights."""
    path, notes = work.output / "MODEL_CARD.md", work.output / NOTES_FILE
    text = notes.read_text(encoding="utf-8") if notes.exists() else ""
    path.write_text(model_card(figures, text).rstrip() + "\n", encoding="utf-8")
    draw_confusion(figures["held_out"], work.output)
    draw_reliability({title: figures[name] for name, title in SHORT.items()}, work.output)
    return path


def _measure_facts(work: TrainingFolders, encoder: MiniEncoder) -> dict[str, float]:
    frames, vocabulary = _open_frames(work, "train"), work.vocabulary
    picture = np.asarray(frames.rgb[0])
    times_ms: list[float] = []
    for _ in range(TIMED_IMAGES):
        begun_s = time.perf_counter()
        encoder.encode(picture)
        times_ms.append((time.perf_counter() - begun_s) * 1e3)
    return {
        "parameters": sum(p.numel() for p in MiniNetwork().parameters()) / 1e6,
        "encode_ms": float(np.median(times_ms)),
        "words": len(vocabulary.words),
        "neutral": len(vocabulary.neutral),
        "frames": len(frames),
        "apartments": frames.scenes,
        "temperature": encoder.embed_text(vocabulary.names[:1]).temperature,
    }


def _open_frames(work: TrainingFolders, name: str) -> FrameDataset:
    try:
        return open_frames(work.folder / name)
    except FileNotFoundError as problem:
        raise TrainingError(str(problem)) from problem


def _open_sentence_encoder() -> TextEmbedder:
    folder = find_model_folder()
    if folder is None:
        raise TrainingError(f"training needs the sentence encoder: {INSTALL}")
    return MiniLm(folder).embed


class _progress_bar:  # noqa: N801 - used like a function
    """A progress bar on stderr; yields a function of (done, note)."""

    def __init__(self, title: str, total: int) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[note]}"),
        )
        self._task = self._progress.add_task(title, total=total, note="")

    def __enter__(self) -> Callable[[int, str], None]:
        self._progress.start()

        def show(done: int, note: str) -> None:
            self._progress.update(self._task, completed=done, note=note)

        return show

    def __exit__(self, *_: object) -> None:
        self._progress.stop()


def _save_calibration(folder: Path, calibration: Calibration) -> None:
    """Write ``calibration.json``."""
    text = json.dumps(asdict(calibration), indent=2) + "\n"
    (folder / CALIBRATION_FILE).write_text(text, encoding="utf-8")
