"""Training of mini in the small: data, losses, loop, export and figures of merit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from onemap_perception.detectors.protocol import Image
from onemap_perception.text.vocabulary import ObjectClass, Vocabulary
from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages import TextEmbeddings
from onemap_tools.export.mini import export_network, least_cosine, write_embedding_table
from onemap_tools.train.commands import app
from onemap_tools.train.data.augmentation import augment_strong, augment_weak
from onemap_tools.train.data.batches import BatchSource, class_frequency
from onemap_tools.train.data.frame_dataset import (
    NO_CLASS,
    FrameDataset,
    FrameSetParams,
    open_frames,
    render_frames,
)
from onemap_tools.train.data.text_targets import TextBank, build_text_bank
from onemap_tools.train.evaluation import metrics
from onemap_tools.train.evaluation.calibration import most_likely_temperature
from onemap_tools.train.evaluation.detector_metrics import DetectorMetrics
from onemap_tools.train.evaluation.evaluate import evaluate
from onemap_tools.train.evaluation.model_card import model_card
from onemap_tools.train.evaluation.plots import (
    CONFUSION_FILE,
    RELIABILITY_FILE,
    draw_confusion,
    draw_reliability,
)
from onemap_tools.train.network.backbone import (
    FROZEN_STAGES,
    WIDTHS,
    EfficientNetLite0,
    load_backbone_weights,
)
from onemap_tools.train.network.losses import (
    LossParams,
    alignment_loss,
    class_weights,
    patch_targets,
)
from onemap_tools.train.network.mini_network import MiniNetwork
from onemap_tools.train.summary import lines
from onemap_tools.train.trainer import TrainingProgress, TrainParams, load_average, train_mini
from tests.simulator.scenes import box_room

VOCABULARY = Vocabulary(
    prompt="a {}",
    classes=(
        ObjectClass("wall", ("wall", "partition"), ("panel",)),
        ObjectClass("sofa", ("sofa", "couch", "settee"), ("divan",)),
    ),
    neutral=("car",),
    common=("piano",),
)
SMALL = TrainParams(
    steps=3, batch=2, size=(64, 48), warmup=1, checkpoint_every=2, ema=0.5, whole=0.4
)


def embed(texts: Sequence[str]) -> F32:
    """Random but fixed directions, one per text."""
    rows = [np.random.default_rng(list(text.encode())).normal(size=384) for text in texts]
    return np.stack([row / np.linalg.norm(row) for row in rows]).astype(np.float32)


@pytest.fixture(scope="module")
def frames() -> FrameDataset:
    """Dark walls with a bright sofa in them."""
    rng = np.random.default_rng(0)
    label = np.zeros((6, 96, 128), np.uint8)
    for picture in label:
        y, x = rng.integers(0, 48, 2)
        picture[y : y + 40, x : x + 60] = 1
    label[:, :4] = NO_CLASS
    rgb = np.where(label[..., None] == 1, 200, 60) + rng.integers(0, 20, (*label.shape, 3))
    return FrameDataset(rgb.astype(np.uint8), label, VOCABULARY.names)


def test_rendered_frames_resume_and_repeat(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    room = box_room()
    monkeypatch.setattr("onemap_tools.train.data.frame_dataset.generate_apartment", lambda *_: room)
    names = ("wall", "floor", "sofa")
    plan = FrameSetParams((901, 902), per_scene=2, width=32, height=24)
    list(render_frames(tmp_path / "whole", names, plan))
    assert next(iter(render_frames(tmp_path / "halves", names, plan))) == 2
    assert len(open_frames(tmp_path / "halves")) == 2
    assert list(render_frames(tmp_path / "halves", names, plan)) == [4]
    whole, halves = open_frames(tmp_path / "whole"), open_frames(tmp_path / "halves")
    np.testing.assert_array_equal(whole.rgb, halves.rgb)
    np.testing.assert_array_equal(whole.label, halves.label)
    assert {0, 1} <= set(np.unique(whole.label).tolist()) <= {0, 1, 2, NO_CLASS}
    with pytest.raises(ValueError, match="holds other frames"):
        list(render_frames(tmp_path / "whole", names, replace(plan, per_scene=3)))
    with pytest.raises(FileNotFoundError, match="render them first"):
        open_frames(tmp_path / "nowhere")


@pytest.mark.slow
def test_processes_render_the_same_frames(tmp_path: Path) -> None:
    plan = FrameSetParams((901, 902), per_scene=2, width=32, height=24)
    for processes in (1, 2):
        done = render_frames(tmp_path / str(processes), ("wall", "floor"), plan, processes)
        assert list(done) == [2, 4]
    alone, together = open_frames(tmp_path / "1"), open_frames(tmp_path / "2")
    np.testing.assert_array_equal(alone.rgb, together.rgb)
    np.testing.assert_array_equal(alone.label, together.label)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
@pytest.mark.parametrize("change", [augment_strong, augment_weak])
def test_augmented_pictures_have_the_size_and_known_labels(
    change: Callable[..., tuple[U8, U8]], seed: int, frames: FrameDataset
) -> None:
    rng = np.random.default_rng(seed)
    rgb, label = change(frames.rgb[0], frames.label[0], (64, 48), rng)
    assert rgb.shape == (48, 64, 3)
    assert rgb.dtype == label.dtype == np.uint8
    assert label.shape == (48, 64)
    assert set(np.unique(label).tolist()) <= {0, 1, NO_CLASS}


def test_batches_depend_on_seed_and_step_alone(frames: FrameDataset) -> None:
    source = BatchSource(frames, (64, 48), batch=3, seed=5, finish_from=3, whole_from=4)
    streamed = list(source.stream(2, 4))
    again = source.make(3)
    np.testing.assert_array_equal(streamed[1].rgb, again.rgb)
    np.testing.assert_array_equal(streamed[1].targets, again.targets)
    assert again.rgb.shape == (3, 48, 64, 3)
    assert again.targets.shape == (3 * 6 * 8, 2)
    assert not np.array_equal(streamed[0].rgb, again.rgb)
    assert source.make(4).rgb.shape == (1, 96, 128, 3)  # whole pictures, half as many


def test_patch_targets_are_shares_of_pixels() -> None:
    label = np.zeros((1, 8, 16), np.uint8)
    label[0, :2, :8] = 1
    label[0, :, 12:] = NO_CLASS
    np.testing.assert_allclose(patch_targets(label, 2), [[0.75, 0.25], [0.5, 0.0]])


def test_rare_classes_weigh_more_and_the_mean_is_one(frames: FrameDataset) -> None:
    frequency = class_frequency(frames, np.random.default_rng(0))
    assert frequency.sum() == pytest.approx(1)
    weights = class_weights(np.array([0.9, 0.1, 0.0], np.float32), 0.5).numpy()
    assert weights[2] > weights[1] > weights[0]
    assert weights @ np.array([0.9, 0.1, 0]) == pytest.approx(1, rel=0.02)


def test_the_loss_is_least_at_the_right_text() -> None:
    texts = torch.eye(3, 384)
    targets = torch.tensor([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    weights = torch.ones(2)

    def loss(features: torch.Tensor) -> float:
        return alignment_loss(features, targets, texts, weights, LossParams()).item()

    right, wrong, neutral = texts[[0, 1, 2]], texts[[1, 0, 2]], texts[[2, 2, 2]]
    assert loss(right) == pytest.approx(0, abs=1e-6)
    assert loss(wrong) > 10
    assert loss(neutral) > 10
    assert loss(5 * right) == pytest.approx(loss(right), abs=1e-6)


def test_the_text_bank_draws_aliases_of_the_class() -> None:
    bank = build_text_bank(VOCABULARY, embed)
    assert bank.aliases.shape == (2, 3, 384)
    drawn = bank.draw(torch.Generator().manual_seed(0)).numpy()
    assert drawn.shape == (3, 384)
    for row, entry in zip(drawn[:2], VOCABULARY.classes, strict=True):
        assert max(row @ embed([f"a {word}"])[0] for word in entry.aliases) > 0.999
    np.testing.assert_allclose(drawn[2], embed(["a car"])[0])


def run(
    frames: FrameDataset,
    folder: Path,
    how: TrainParams,
    *,
    stop_at: int = 0,
) -> tuple[MiniNetwork, list[TrainingProgress]]:
    """Train; ``stop_at`` interrupts after that step, as Ctrl-C would."""
    reports: list[TrainingProgress] = []

    def note(report: TrainingProgress) -> None:
        reports.append(report)
        if report.step == stop_at:
            raise KeyboardInterrupt

    bank: TextBank = build_text_bank(VOCABULARY, embed)
    network = train_mini(
        frames,
        bank,
        folder,
        settings=how,
        device=torch.device("cpu"),
        report=note,
    )
    return network, reports


def weights_of(network: MiniNetwork) -> torch.Tensor:
    return torch.cat([value.flatten().float() for value in network.state_dict().values()])


def test_training_repeats_and_resumes(frames: FrameDataset, tmp_path: Path) -> None:
    whole, reports = run(frames, tmp_path / "whole", SMALL)
    assert [report.step for report in reports] == [1, 2, 3, 4]
    run(frames, tmp_path / "parts", replace(SMALL, checkpoint_every=2))
    assert torch.equal(weights_of(load_average(tmp_path / "parts")), weights_of(whole))
    # An interruption after step 2: what comes after the checkpoint is done again.
    broken = tmp_path / "broken"
    with pytest.raises(KeyboardInterrupt):
        run(frames, broken, SMALL, stop_at=3)
    resumed, rest = run(frames, broken, SMALL)
    assert [report.step for report in rest] == [3, 4]
    torch.testing.assert_close(weights_of(resumed), weights_of(whole), rtol=1e-3, atol=1e-4)


def published(trunk: EfficientNetLite0, path: Path) -> Path:
    """A checkpoint as the weight package has it: other names, same order, and a classifier."""
    tensors = {f"_blocks.{i}": t for i, t in enumerate(trunk.state_dict().values())}
    rest = {"_conv_head.weight": torch.zeros(8), "_bn1.bias": torch.zeros(8)}
    torch.save({**tensors, **rest, "_fc.weight": torch.zeros(8)}, path)
    return path


def test_training_begins_with_the_trunk_and_keeps_its_finest_layers(
    frames: FrameDataset, tmp_path: Path
) -> None:
    torch.manual_seed(7)
    trunk = EfficientNetLite0()
    file = published(trunk, tmp_path / "weights.pth")
    network, _ = run(frames, tmp_path / "run", replace(SMALL, learning_rate=0.1, trunk=file))
    source = trunk.state_dict()
    kept = tuple(f"stages.{index}." for index in range(FROZEN_STAGES)) + ("stem.",)
    for name, tensor in network.trunk.state_dict().items():
        if name.endswith("num_batches_tracked"):
            continue
        same = torch.allclose(tensor, source[name], rtol=1e-4, atol=1e-6)
        assert same == name.startswith(kept), name


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    torch.save({"_conv_stem.weight": torch.zeros(3)}, tmp_path / "other.pth")
    with pytest.raises(ValueError, match="does not hold the trunk"):
        load_backbone_weights(EfficientNetLite0(), tmp_path / "other.pth")


def test_sizes_are_rounded_up() -> None:
    levels = EfficientNetLite0().eval()(torch.zeros(1, 3, 120, 72))
    assert [tuple(level.shape[2:]) for level in levels] == [(30, 18), (15, 9), (8, 5), (4, 3)]
    assert tuple(level.shape[1] for level in levels) == WIDTHS


def test_what_is_exported_agrees_with_torch(tmp_path: Path) -> None:
    torch.manual_seed(0)
    network = MiniNetwork().eval()
    path = export_network(network, tmp_path)
    pictures = np.random.default_rng(0).integers(0, 256, (2, 64, 88, 3), dtype=np.uint8)
    assert least_cosine(network, path, pictures) > 0.999
    assert path.stat().st_size < 12 * 2**20


def test_the_word_table_holds_every_word(tmp_path: Path) -> None:
    path = write_embedding_table(VOCABULARY, embed, tmp_path)
    with np.load(path, allow_pickle=False) as table:
        assert table["words"].tolist() == list(VOCABULARY.words)
        np.testing.assert_allclose(
            table["embeddings"][0].astype(np.float32), embed(["a car"])[0], atol=1e-3
        )


@given(factor=st.floats(6, 70))
@settings(max_examples=10, deadline=None)
def test_the_temperature_is_found_again(factor: float) -> None:
    rng = np.random.default_rng(0)
    cosines = rng.uniform(-0.3, 0.9, (4000, 5)).astype(np.float32)
    shares = np.exp(factor * cosines)
    shares /= shares.sum(axis=1, keepdims=True)
    assert most_likely_temperature(cosines, shares.astype(np.float32)) == pytest.approx(
        factor, rel=0.06
    )


def test_confusion_accuracy_and_iou() -> None:
    label = np.array([[0, 0, 1], [1, 1, 255]], np.uint8)
    predicted = np.array([[0, 1, 1], [1, 1, 0]])
    counts = metrics.confusion(label, predicted, 3)
    assert counts.tolist() == [[1, 1, 0], [0, 3, 0], [0, 0, 0]]
    assert metrics.accuracy(counts) == pytest.approx(0.8)
    np.testing.assert_allclose(metrics.iou(counts), [0.5, 0.75, np.nan])


def test_r_precision_counts_the_best() -> None:
    scores = np.array([0.9, 0.1, 0.8, 0.7], np.float32)
    assert metrics.r_precision(scores, np.array([True, False, False, True])) == 0.5
    assert np.isnan(metrics.r_precision(scores, np.zeros(4, bool)))


@given(
    positive=st.lists(st.integers(0, 5), min_size=1, max_size=8),
    negative=st.lists(st.integers(0, 5), min_size=1, max_size=8),
)
def test_auroc_is_the_chance_that_a_positive_scores_above(
    positive: list[int], negative: list[int]
) -> None:
    scores = np.array([*positive, *negative], np.float64)
    slow = np.mean([1.0 if p > n else 0.5 if p == n else 0.0 for p in positive for n in negative])
    fast = metrics.auroc(scores, np.arange(len(scores)) < len(positive))
    assert fast == pytest.approx(float(slow))


def test_reliability_of_honest_and_boastful_probabilities() -> None:
    probability = np.array([0.05, 0.15, 0.95, 0.95])
    honest = metrics.reliability(probability, probability)
    assert metrics.calibration_error(honest) == pytest.approx(0)
    boastful = metrics.reliability(probability, np.zeros(4))
    assert metrics.calibration_error(boastful) == pytest.approx(float(probability.mean()))
    assert [row["count"] for row in honest] == [1, 1, 2]


class PerfectEncoder:
    """Implements ``Encoder``: bright is a sofa, dark is a wall, in the space of ``embed``."""

    encoder_id = "perfect"
    text_space = "test"

    def encode(self, rgb: U8) -> F16:
        bright = rgb[4::8, 4::8, 0] > 128
        features: F16 = np.eye(3, dtype=np.float16)[bright.astype(int)]
        return features

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        axes = np.eye(3, dtype=np.float32)
        words = [(*entry.aliases, *entry.held_out) for entry in VOCABULARY.classes]
        chosen = [next(i for i, known in enumerate(words) if text in known) for text in texts]
        return TextEmbeddings(
            encoder_id=self.encoder_id,
            text_space=self.text_space,
            texts=tuple(texts),
            embeddings=axes[chosen],
            neutral=axes,
            neutral_mask=(1 - axes[chosen]).astype(np.uint8),
            temperature=20.0,
        )


def test_a_perfect_encoder_has_perfect_figures_and_a_card() -> None:
    label = np.zeros((2, 48, 64), np.uint8)
    label[0, 16:32, 16:48] = 1
    rgb = np.repeat(np.where(label == 1, 200, 20).astype(np.uint8)[..., None], 3, axis=-1)
    seen: list[int] = []
    part = evaluate(
        PerfectEncoder(), VOCABULARY, FrameDataset(rgb, label, VOCABULARY.names), seen.append
    )
    assert seen == [1, 2]
    names, held_out = part["names"], part["held_out_aliases"]
    assert isinstance(names, dict)
    assert isinstance(held_out, dict)
    assert names["r_precision"] == held_out["r_precision"] == 1
    assert names["auroc_pooled"] == 1
    assert part["detector"] == {"precision": 1, "recall": 1, "wrong_per_picture": 0}
    assert part["pixel_accuracy"] == pytest.approx(1, abs=0.03)  # edges run through patches
    facts = dict.fromkeys(
        ("parameters", "encode_ms", "words", "neutral", "frames", "apartments", "temperature"), 1
    )
    figures = {"encoder_id": "perfect", "facts": facts, "held_out": part, "other_style": part}
    card = model_card(figures)
    assert "encoder `perfect`" in card
    assert "| R-precision, class names | 1.000 | 1.000 |" in card
    assert f"]({CONFUSION_FILE})" in card
    assert f"]({RELIABILITY_FILE})" in card
    assert any("held_out: 2 frames" in line for line in lines(figures))


def test_the_cards_pictures_are_pictures(tmp_path: Path) -> None:
    part = {
        "class_names": ["wall", "sofa"],
        "confusion": [[90, 10], [0, 0]],
        "reliability": [{"stated": 0.1, "right": 0.2, "count": 5.0}],
    }
    for path in (draw_confusion(part, tmp_path), draw_reliability({"here": part}, tmp_path)):
        picture = cv2.imread(str(path))
        assert picture is not None
        assert min(picture.shape[:2]) > 300
        assert picture.std() > 5


def test_wrong_and_missed_things_are_told_apart() -> None:
    encoder = PerfectEncoder()
    rgb = np.full((48, 64, 3), 20, np.uint8)
    rgb[:32, :24] = 200  # looks like a sofa, and is a wall
    shares = np.tile(np.array([1, 0], np.float32), (48, 1))
    shares[-8:] = (0, 1)  # the sofa looks like a wall
    tally = DetectorMetrics(VOCABULARY.names)
    tally.add(Image(rgb, encoder.encode(rgb)), encoder.embed_text(VOCABULARY.names), shares)
    assert tally.summary() == {"precision": 0.5, "recall": 0.5, "wrong_per_picture": 1}


def test_a_step_without_its_input_says_which_comes_first(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["train", "--work", str(tmp_path)])
    assert result.exit_code == 2
    assert "render them first" in result.output
