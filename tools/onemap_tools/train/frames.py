"""Frames of procedural apartments on disk: rendered once, read through memory maps.

A folder holds ``frames.json``, what it is for, and of each apartment a file ``SEED.npy``
(N, H, W, 4) uint8: colour, and the index of the class (255 = none). A file that is there is
whole, so that an interrupted rendering can be continued.
"""
# Touches files: frames.

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from onemap_shared.atomic_file import replacing
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import U8
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING, Style
from onemap_simulator.rendering.camera_poses import CameraPoseRange, sample_camera_poses
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from onemap_tools.processes.worker_pool import worker_pool

NO_CLASS = 255
RECORD = "frames.json"
TRAIN_SEEDS = range(1000, 100_000)
EVALUATION_SEEDS = range(900, 1000)  # not trained on, like the demo's 1 to 3
FOV_RAD = (1.05, 1.65)  # 60 to 95 degrees: common depth cameras
ROBOT_VIEWS = CameraPoseRange()
OTHER_VIEWS = CameraPoseRange(camera_height_m=(0.4, 1.6), pitch_rad=(-0.3, 0.6))
OTHER_SHARE = 0.3  # of the frames: seen from other heights than the simulated robot's


@dataclass(frozen=True, slots=True)
class FrameSetSpec:
    """A set of frames to render: ``per_scene`` of each seed's apartment in one style."""

    seeds: tuple[int, ...]
    per_scene: int = 20
    width: int = 320
    height: int = 240
    style: Style = TRAINING

    @property
    def count(self) -> int:
        """Number of frames."""
        return len(self.seeds) * self.per_scene


@dataclass(frozen=True, slots=True)
class FrameDataset:
    """Frames with labels, index into ``classes`` or 255. images: (N, H, W, 4) of each apartment,
    the same N for all, or the files that hold them."""

    images: tuple[U8 | Path, ...]
    per_scene: int
    classes: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.images) * self.per_scene

    def __getitem__(self, index: int) -> tuple[U8, U8]:
        """rgb (H, W, 3) and label (H, W) of a frame; IndexError beyond the last."""
        scene, number = divmod(index, self.per_scene)
        images = self.images[scene]
        frame = (np.load(images, mmap_mode="r") if isinstance(images, Path) else images)[number]
        return np.array(frame[..., :3]), np.array(frame[..., 3])


def render_scene(seed: int, classes: Sequence[str], spec: FrameSetSpec) -> U8:
    """Colour and label (N, H, W, 4) of one apartment; N = ``spec.per_scene``.

    A function of the seed: the order of rendering and interruptions do not change them.
    """
    scene = generate_apartment(seed, spec.style)
    rng = np.random.default_rng([seed, spec.per_scene])
    index_of = {name: index for index, name in enumerate(classes)}
    table = [index_of.get(thing.category, NO_CLASS) for thing in scene.objects]
    label_of = np.array([*table, NO_CLASS], np.uint8)  # label -1: nothing was hit
    renderer = Renderer(scene)
    other = round(spec.per_scene * OTHER_SHARE)
    poses = sample_camera_poses(scene, rng, spec.per_scene - other, ROBOT_VIEWS)
    poses += sample_camera_poses(scene, rng, other, OTHER_VIEWS)
    images = np.empty((len(poses), spec.height, spec.width, 4), np.uint8)
    for index, pose in enumerate(poses):
        camera = Intrinsics.from_fov(spec.width, spec.height, rng.uniform(*FOV_RAD))
        view: RenderedImage = renderer.render(pose, camera, width=spec.width, height=spec.height)
        images[index, ..., :3], images[index, ..., 3] = view.rgb, label_of[view.labels]
    return images


def render_frames(
    folder: Path, classes: Sequence[str], spec: FrameSetSpec, processes: int = 1
) -> Iterator[int]:
    """Render the missing frames; yields the number of frames done after each scene.

    Raises ValueError if the folder holds other frames.
    """
    _open_folder(folder, classes, spec)
    todo = [seed for seed in spec.seeds if not _file(folder, seed).exists()]
    render = partial(render_scene, classes=tuple(classes), spec=spec)
    with worker_pool(processes) as pool:
        scenes = deque(pool.submit(render, seed) for seed in todo)
        for done, seed in enumerate(todo, len(spec.seeds) - len(todo) + 1):
            with replacing(_file(folder, seed)) as file:
                np.save(file, scenes.popleft().result())
            yield done * spec.per_scene


def open_frames(folder: Path) -> FrameDataset:
    """The rendered frames of a folder; FileNotFoundError if there are none."""
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise FileNotFoundError(f"no frames in {folder}: render them first") from None
    files = (_file(folder, seed) for seed in record["seeds"])
    there = tuple(file for file in files if file.exists())
    return FrameDataset(there, record["per_scene"], tuple(record["classes"]))


def _file(folder: Path, seed: int) -> Path:
    return folder / f"{seed}.npy"


def _open_folder(folder: Path, classes: Sequence[str], spec: FrameSetSpec) -> None:
    """Note in the folder which frames it is for; ValueError if it is for others."""
    wanted = {
        "classes": list(classes),
        "seeds": list(spec.seeds),
        "per_scene": spec.per_scene,
        "size": [spec.width, spec.height],
        "style": spec.style.name,
    }
    path = folder / RECORD
    if not path.exists():
        with replacing(path) as file:
            file.write(json.dumps(wanted).encode())
    record = json.loads(path.read_text(encoding="utf-8"))
    if other := [key for key in wanted if record.get(key) != wanted[key]]:
        raise ValueError(
            f"{folder} holds other frames than asked for, with other {other[0]}: choose another "
            "folder"
        )
