"""The encoder of photographs: its features, its files, and what it sees in photographs."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from onemap_perception.config import SHIPPED, MiniParams, PatchesParams, PhotoParams
from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.detectors.protocol import Image
from onemap_perception.encoders.images import decoded
from onemap_perception.encoders.mini import MiniEncoder
from onemap_perception.encoders.photo import (
    FOLDER,
    NAMES_FILE,
    NETWORK_FILE,
    STRIDE,
    PhotoEncoder,
    at_patches,
    household_names,
    mean_entropy,
)
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_detector
from onemap_perception.target_detection import backproject_detections
from onemap_perception.text.embeddings import scores
from onemap_perception.text.vocabulary import load_table, load_vocabulary
from onemap_shared.geometry import F32, U8
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import HELD_OUT, TRAINING, Style
from onemap_simulator.rendering.camera_poses import sample_camera_poses
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_tools.bench.frames import rendered_frames
from onemap_tools.bench.scene import read_labels, recorded_frames
from onemap_tools.models.calibration import EXCLUDED_CLASSES

PHOTOGRAPHS = Path(__file__).parents[4] / "shared" / "data" / "rgbd_study"
LABELS = Path(__file__).parents[2] / "data" / "rgbd_study.yaml"


@pytest.fixture(scope="module")
def encoder() -> PhotoEncoder:
    return PhotoEncoder(PhotoParams())


@pytest.fixture(scope="module")
def mini() -> MiniEncoder:
    return MiniEncoder(MiniParams())


@pytest.mark.parametrize(("height", "width"), [(240, 320), (480, 640), (61, 50), (1, 1)])
def test_patches_and_words_are_those_of_mini(
    encoder: PhotoEncoder, mini: MiniEncoder, height: int, width: int
) -> None:
    image = np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)
    features = encoder.encode(image)
    assert features.shape == mini.encode(image).shape
    assert features.dtype == np.float16
    norms = np.linalg.norm(features.astype(np.float32), axis=-1)
    np.testing.assert_allclose(norms, 1, atol=2e-3)
    assert encoder.text_space == mini.text_space
    assert encoder.encoder_id != mini.encoder_id
    ours, theirs = encoder.embed_text(["sofa"]), mini.embed_text(["sofa"])
    np.testing.assert_array_equal(ours.embeddings, theirs.embeddings)
    assert ours.encoder_id == encoder.embed_image(image).encoder_id == encoder.encoder_id


@pytest.mark.parametrize(
    ("name", "looks", "kept"),
    [  # what mini and the classifier see
        ("sofa", ("sofa", "sofa"), True),
        ("sofa", ("bed", "sofa"), False),
        ("sofa", ("sofa", "bed"), False),
        ("mirror", ("mirror", "bed"), True),  # no name of the classifier
        ("printer", ("bed", "printer"), True),  # no class of mini
        ("printer", ("printer", "bed"), False),
        ("sofa", ("bed", ""), True),  # not asked: the features alone count
    ],
)
def test_a_detection_is_what_both_networks_see_of_the_names_that_they_know(
    encoder: PhotoEncoder,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    looks: tuple[str, str],
    kept: bool,
) -> None:
    image = np.zeros((48, 64, 3), np.uint8)

    def all_of(word: str) -> F32:
        return np.tile(encoder.embed_text((word,)).embeddings[0], (6, 8, 1))

    seen_by_each = tuple(all_of(word) if word else None for word in looks)
    monkeypatch.setattr(encoder, "looks", lambda rgb: seen_by_each)
    seen = Image(image, all_of(name).astype(np.float16))
    found = make_detector(PatchesParams(), encoder).detect(seen, encoder.embed_text((name, "lamp")))
    assert [each.name for each in found] == [name] * kept


def test_what_both_networks_see_is_kept_for_the_newest_image(encoder: PhotoEncoder) -> None:
    image = np.random.default_rng(0).integers(0, 256, (48, 64, 3), dtype=np.uint8)
    encoder.encode(image)
    features, opinion = encoder.looks(image)
    assert opinion is not None
    assert features.shape == opinion.shape
    assert encoder.looks(image)[0] is features
    other = image.copy()
    assert encoder.looks(other)[0] is not features
    np.testing.assert_array_equal(encoder.looks(other)[0], features)


@pytest.mark.parametrize("style", [TRAINING, HELD_OUT])
def test_in_the_simulator_the_classifier_is_not_asked(
    encoder: PhotoEncoder, mini: MiniEncoder, style: Style
) -> None:
    scene = generate_apartment(29, style)
    poses = sample_camera_poses(scene, np.random.default_rng(29), 6)
    for frame, _ in rendered_frames(scene, CameraParams(), poses):
        np.testing.assert_array_equal(encoder.encode(frame.rgb), mini.encode(frame.rgb))


def test_entropy_is_the_logarithm_of_how_many_classes_are_equally_likely() -> None:
    shares = np.zeros((2, 1, 8), np.float32)
    shares[0, 0, 3], shares[1, 0, :4] = 1, 0.25
    assert mean_entropy(shares) == pytest.approx(np.log(4) / 2)


def test_positions_are_interpolated_where_their_convolutions_are_centred() -> None:
    rows, columns, size = 6, 8, (64, 48)
    y, x = np.mgrid[0:3, 0:4].astype(np.float32) * STRIDE  # pixel of each position
    at_y, at_x = np.moveaxis(at_patches(np.stack([y, x], axis=-1), size, rows, columns), -1, 0)
    np.testing.assert_allclose(at_x[0], np.clip(np.arange(8) * 8 + 3.5, 0, 48), atol=1e-4)
    np.testing.assert_allclose(at_y[:, 0], np.clip(np.arange(6) * 8 + 3.5, 0, 32), atol=1e-4)


def test_damaged_or_missing_files_are_refused_in_a_sentence(tmp_path: Path) -> None:
    shutil.copytree(FOLDER, tmp_path / "photo")
    weights = tmp_path / "photo" / NETWORK_FILE
    weights.write_bytes(weights.read_bytes()[:-1])
    with pytest.raises(BackendError, match=r"is damaged: its SHA-256 is .* reinstall OneMap"):
        PhotoEncoder(PhotoParams(), tmp_path / "photo")
    weights.unlink()
    with pytest.raises(BackendError, match=r"photo\.onnx is missing: reinstall OneMap"):
        PhotoEncoder(PhotoParams(), tmp_path / "photo")
    shutil.copy(FOLDER / NETWORK_FILE, weights)
    (tmp_path / "photo" / NAMES_FILE).write_text("{", encoding="utf-8")
    with pytest.raises(BackendError, match=r"cannot read .*names"):
        PhotoEncoder(PhotoParams(), tmp_path / "photo")


def test_every_household_name_has_an_embedding_that_ships() -> None:
    words = load_table(SHIPPED).words
    assert set(household_names()) - {""} <= set(words)


def photograph(number: int) -> U8:
    path = PHOTOGRAPHS / f"frame-{number:06d}.color.png"
    if not path.exists():
        pytest.skip(f"{path} is not there: the photographs lie beside the repository")
    return decoded(path.read_bytes())


Box = tuple[slice, slice]  # rows and columns of patches
WHOLE: Box = np.s_[:, :]


def mean_score(encoder: PhotoEncoder | MiniEncoder, image: U8, word: str, box: Box) -> float:
    features = encoder.encode(image).astype(np.float32)[box]
    return float(scores(features.reshape(-1, 384), encoder.embed_text([word])).mean())


@pytest.mark.parametrize(
    ("number", "word", "patches"),
    [
        (422, "printer", np.s_[18:22, 21:25]),
        (422, "chair", np.s_[19:25, 2:6]),
        (0, "sofa", np.s_[14:24, 12:26]),
    ],
)
def test_a_thing_in_a_photograph_scores_higher_than_with_mini(
    encoder: PhotoEncoder, mini: MiniEncoder, number: int, word: str, patches: Box
) -> None:
    image = photograph(number)
    ours = mean_score(encoder, image, word, patches)
    assert ours > mean_score(mini, image, word, patches)
    assert ours > 3 * mean_score(encoder, image, word, WHOLE)


@pytest.mark.skipif(not PHOTOGRAPHS.exists(), reason="the photographs are not here")
def test_in_photographs_most_false_detections_go_and_nearly_all_true_ones_stay(
    encoder: PhotoEncoder,
) -> None:
    """Of all classes of mini and the printer: counts of true and false ones."""
    labels = read_labels(LABELS)
    classes = (name for name in load_vocabulary(SHIPPED).names if name not in EXCLUDED_CLASSES)
    names = encoder.embed_text((*classes, "printer"))
    counts = []
    for detector in (PatchDetector(encoder.encoder_id), make_detector(PatchesParams(), encoder)):
        seen = []
        for frame in recorded_frames(PHOTOGRAPHS, print):
            found = detector.detect(Image(frame.rgb, encoder.encode(frame.rgb)), names)
            points, owner = backproject_detections(found, frame)
            for index, detection in enumerate(found):
                middle = np.median(points[owner == index, :2], axis=0)
                there = [label for label in labels if label.name == detection.name]
                seen.append(any(label.holds(middle) for label in there))
        counts.append((sum(seen), len(seen) - sum(seen)))
    (true_before, false_before), (true, false) = counts
    print(counts)
    assert true >= 0.9 * true_before
    assert false <= 0.5 * false_before
