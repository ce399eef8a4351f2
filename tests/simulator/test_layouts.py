"""Recordings in the layouts of TUM RGB-D and ScanNet: the same frames as in our own."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from onemap_mapper.config import MapperConfig
from onemap_mapper.storage.snapshot import sha256_of, take
from onemap_perception.config import PerceptionConfig
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64, camera_mount, pose_2d
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_simulator.replay.layouts import TUM_SIZE, is_recording, read_recording
from onemap_simulator.replay.recording import RecordedFrame, Recording, RecordingError
from onemap_simulator.scene.loading import load_scene
from onemap_tools.bench.frames import map_of, rendered_frames
from onemap_tools.bench.scene import recorded_frames
from tests.simulator.recordings import write_recording
from tests.tools.bench.furnished import write_room

LENS = Intrinsics(320.0, 310.0, 318.0, 241.0)
FLOOR_M = 0.25  # of the worlds that these layouts are written in
BEGIN_S = 1305031102.0


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> list[RecordedFrame]:
    """Two images of a furnished room from poses that are turned about all axes."""
    scene = load_scene(write_room(tmp_path_factory.mktemp("room") / "room.glb"))
    camera = CameraParams(width=TUM_SIZE[0], height=TUM_SIZE[1])
    poses = [
        pose_2d(*scene.start[:2], yaw) @ camera_mount(0.1, 1.1, 0.3) @ rolled(0.1)
        for yaw in (0.4, 2.0)
    ]
    views = rendered_frames(scene, camera, poses)
    return [RecordedFrame(each.rgb, each.depth_mm, each.T_map_camera) for each, _ in views]


def rolled(angle: float) -> F64:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", angle).as_matrix()
    return T


def world_poses(frames: Sequence[RecordedFrame]) -> list[F64]:
    """T_world_camera where the floor lies at FLOOR_M."""
    raised = pose_2d(0.0, 0.0, 0.0)
    raised[2, 3] = FLOOR_M
    return [raised @ frame.T_map_camera for frame in frames]


def camera_file(folder: Path, **entries: object) -> None:
    (folder / "camera.json").write_text(json.dumps({"floor_m": FLOOR_M, **entries}))


def write_tum(folder: Path, frames: Sequence[RecordedFrame]) -> Path:
    """As TUM's tools write it: depth 8 ms later, a pose every 10 ms, quaternion x y z w."""
    folder.mkdir()
    lists: dict[str, list[str]] = {"rgb": ["# color"], "depth": ["# depth"], "groundtruth": ["# t"]}
    for index, (frame, T) in enumerate(zip(frames, world_poses(frames), strict=True)):
        at_s = BEGIN_S + 0.5 * index
        cv2.imwrite(str(folder / f"{at_s:.6f}.png"), frame.rgb[..., ::-1])
        cv2.imwrite(str(folder / f"d{at_s:.6f}.png"), frame.depth_mm * 5)
        lists["rgb"].append(f"{at_s:.6f} {at_s:.6f}.png")
        lists["depth"].append(f"{at_s + 0.008:.6f} d{at_s:.6f}.png")
        x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
        for step in (-0.01, 0.0, 0.01):  # the others are 1 m aside
            place = [repr(float(value)) for value in (*(T[:3, 3] + 100 * step), x, y, z, w)]
            lists["groundtruth"].append(f"{at_s + 0.01 + step:.4f} {' '.join(place)}")
    for name, rows in lists.items():
        (folder / f"{name}.txt").write_text("\n".join(rows) + "\n")
    camera_file(folder, intrinsics=[LENS.fx, LENS.fy, LENS.cx - 0.5, LENS.cy - 0.5])
    return folder


def write_scannet(folder: Path, frames: Sequence[RecordedFrame]) -> Path:
    """As SensReader exports it, with frames 9, 10 ... and one whose pose is not known."""
    for name in ("color", "depth", "pose", "intrinsic"):
        (folder / name).mkdir(parents=True)
    for number, (frame, T) in enumerate(zip(frames, world_poses(frames), strict=True), 9):
        cv2.imwrite(str(folder / f"color/{number}.jpg"), frame.rgb[..., ::-1])
        cv2.imwrite(str(folder / f"depth/{number}.png"), frame.depth_mm)
        np.savetxt(folder / f"pose/{number}.txt", T, fmt="%.17g")
    for kind in ("color/8.jpg", "depth/8.png"):
        (folder / kind).write_bytes((folder / kind.replace("8", "9")).read_bytes())
    np.savetxt(folder / "pose/8.txt", np.full((4, 4), -np.inf))
    K = np.eye(4)
    K[:3, :3] = matrix(LENS)
    np.savetxt(folder / "intrinsic/intrinsic_depth.txt", K, fmt="%f")
    camera_file(folder)
    return folder


def matrix(lens: Intrinsics) -> np.ndarray:
    """K (3, 3) with pixel centres at integers."""
    return np.array([[lens.fx, 0, lens.cx - 0.5], [0, lens.fy, lens.cy - 0.5], [0, 0, 1]])


def map_digest(folder: Path) -> str:
    encoder = make_encoder(PerceptionConfig().encoder)
    variance = VarianceParams(PerceptionConfig().variance)
    seen = recorded_frames(folder, lambda _: None)
    return sha256_of(take(map_of(seen, encoder, variance, MapperConfig().map)))


@pytest.mark.parametrize("write", [write_tum, write_scannet], ids=["TUM", "ScanNet"])
def test_another_layout_gives_the_same_frames_and_the_same_map(
    frames: list[RecordedFrame],
    tmp_path: Path,
    write: Callable[[Path, Sequence[RecordedFrame]], Path],
) -> None:
    foreign = read_recording(write(tmp_path / "foreign", frames))
    if write is write_scannet:  # what JPEG leaves of the colours
        decoded = [foreign.frame(index).rgb for index in range(len(frames))]
        frames = [replace(frame, rgb=rgb) for frame, rgb in zip(frames, decoded, strict=True)]
        assert foreign.skipped_sentence.startswith("1 frames are left out")
        assert "the pose of 8.jpg contains NaN or infinity" in foreign.skipped[0]
    ours = [
        replace(frame, T_map_camera=entry.T_map_camera)  # the last bits of a quaternion
        for frame, entry in zip(frames, foreign.entries, strict=True)
    ]
    for frame, pose in zip(frames, (each.T_map_camera for each in ours), strict=True):
        np.testing.assert_allclose(pose, frame.T_map_camera, atol=1e-12)
    write_recording(tmp_path / "ours", ours, LENS)
    assert is_recording(foreign.directory)
    assert foreign.intrinsics == LENS
    assert map_digest(foreign.directory) == map_digest(tmp_path / "ours")


def test_a_world_with_y_up_is_turned(frames: list[RecordedFrame], tmp_path: Path) -> None:
    folder = write_scannet(tmp_path / "phone", frames)
    turned = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])  # z is y
    for number, T in enumerate(world_poses(frames), 9):
        np.savetxt(folder / f"pose/{number}.txt", turned @ T, fmt="%.17g")
    camera_file(folder, up="y")
    for entry, frame in zip(read_recording(folder).entries, frames, strict=True):
        np.testing.assert_allclose(entry.T_map_camera, frame.T_map_camera, atol=1e-12)


def test_larger_colour_images_and_their_intrinsics_are_scaled(
    frames: list[RecordedFrame], tmp_path: Path
) -> None:
    folder = write_scannet(tmp_path / "scan", frames)
    for path in folder.glob("color/*.jpg"):
        image = cv2.imread(str(path))
        assert image is not None
        cv2.imwrite(str(path), np.repeat(np.repeat(image, 2, axis=0), 2, axis=1))
    (folder / "intrinsic/intrinsic_depth.txt").unlink()
    K = np.eye(4)
    K[:3, :3] = matrix(LENS.scaled(2, 2))
    np.savetxt(folder / "intrinsic/intrinsic_color.txt", K)
    recording = read_recording(folder)
    assert recording.intrinsics == LENS
    assert np.abs(recording.frame(0).rgb.astype(int) - frames[0].rgb).mean() < 5


@pytest.mark.parametrize(
    ("folder", "focal"), [("rgbd_dataset_freiburg1_desk", 517.3), ("mine", 525.0)]
)
def test_the_cameras_of_tum_are_known(
    frames: list[RecordedFrame], tmp_path: Path, folder: str, focal: float
) -> None:
    path = write_tum(tmp_path / folder, frames)
    camera_file(path)
    read = read_recording(path)
    assert read.intrinsics.fx == focal
    if folder == "mine":
        assert (read.intrinsics.cx, read.intrinsics.cy) == (320.0, 240.0)  # centres at integers


def edited(path: Path, old: str, new: str) -> None:
    path.write_text(path.read_text().replace(old, new))


def delete(path: Path) -> None:
    path.unlink()


@pytest.mark.parametrize(
    ("file", "edit", "sentence"),
    [
        ("depth.txt", delete, r"cannot read .*depth\.txt: No such file"),
        ("rgb.txt", lambda path: path.write_text("# nothing\n"), r"rgb\.txt lists nothing"),
        ("rgb.txt", lambda path: path.write_text("1.5\n"), r"rgb\.txt, line 1: 1 values, not 2"),
        ("groundtruth.txt", lambda path: edited(path, "13", "23"), "none of the 2 frames .*20 ms"),
        ("camera.json", lambda path: path.write_text('{"fx": 1}'), r"camera\.json: fx .*floor_m"),
        ("camera.json", lambda path: path.write_text('{"up": "x"}'), r"camera\.json: up .*'y'"),
    ],
)
def test_what_is_wrong_with_a_recording_of_tum_is_a_sentence(
    frames: list[RecordedFrame],
    tmp_path: Path,
    file: str,
    edit: Callable[[Path], object],
    sentence: str,
) -> None:
    folder = write_tum(tmp_path / "tum", frames)
    edit(folder / file)
    with pytest.raises(RecordingError, match=sentence) as error:
        read_recording(folder)
    assert "\n" not in str(error.value)


def test_images_of_another_size_are_of_no_camera_of_tum(tmp_path: Path) -> None:
    small = RecordedFrame(np.zeros((6, 8, 3), np.uint8), np.ones((6, 8), np.uint16), np.eye(4))
    folder = write_tum(tmp_path / "tum", [small])
    camera_file(folder)
    with pytest.raises(RecordingError, match=r"are 8 x 6 .* give intrinsics"):
        read_recording(folder)


def test_what_is_wrong_with_a_recording_of_scannet_is_a_sentence(
    frames: list[RecordedFrame], tmp_path: Path
) -> None:
    folder = write_scannet(tmp_path / "scan", frames)
    (folder / "pose/9.txt").write_text("1 2 3")
    (folder / "depth/10.png").unlink()
    with pytest.raises(RecordingError, match=r"none of the 3 frames .* the pose of 8\.jpg"):
        read_recording(folder)
    (folder / "pose/9.txt").write_text(" ".join(map(str, np.eye(4).ravel())))
    assert [each.colour.name for each in read_recording(folder).entries] == ["9.jpg"]
    (folder / "intrinsic/intrinsic_depth.txt").unlink()
    with pytest.raises(RecordingError, match=r"cannot read .*intrinsic_depth\.txt"):
        read_recording(folder)
    for path in folder.glob("color/*"):
        path.unlink()
    with pytest.raises(RecordingError, match=r"color holds no images"):
        read_recording(folder)


def test_our_own_layout_comes_first(tmp_path: Path, frames: list[RecordedFrame]) -> None:
    folder = tmp_path / "ours"
    write_recording(folder, frames, LENS)
    (folder / "rgb.txt").write_text("nothing\n")
    assert read_recording(folder).digest == Recording.open(folder).digest
