"""Frames of procedural apartments on disk: rendered once, read through memory maps.

A folder holds ``rgb.npy`` (N, H, W, 3) uint8, ``label.npy`` (N, H, W) uint8 (index of the
class, 255 = none) and ``frames.json``. Scenes are written one after the other, so that an
interrupted rendering can be continued.
"""

from __future__ import annotations

import json
import shutil
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import U8
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING, Style
from onemap_simulator.rendering.camera_poses import CameraPoseRange, sample_camera_poses
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from onemap_tools.processes.worker_pool import worker_pool

NO_CLASS = 255
BYTES_PER_PIXEL = 4  # three of colour, one of the label
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
    per_scene: int
    width: int = 320
    height: int = 240
    style: Style = TRAINING

    @property
    def count(self) -> int:
        """Number of frames."""
        return len(self.seeds) * self.per_scene


@dataclass(frozen=True, slots=True)
class FrameDataset:
    """rgb (N, H, W, 3) uint8 and label (N, H, W) uint8, index into ``classes`` or 255.

    ``scenes`` is the number of apartments they show.
    """

    rgb: U8
    label: U8
    classes: tuple[str, ...]
    scenes: int = 1

    def __len__(self) -> int:
        return len(self.rgb)


def render_scene(seed: int, classes: Sequence[str], spec: FrameSetSpec) -> tuple[U8, U8]:
    """rgb (N, H, W, 3) and label (N, H, W) of one apartment; N = ``spec.per_scene``.

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
    rgb = np.empty((len(poses), spec.height, spec.width, 3), np.uint8)
    label = np.empty(rgb.shape[:3], np.uint8)
    for index, pose in enumerate(poses):
        camera = Intrinsics.from_fov(spec.width, spec.height, rng.uniform(*FOV_RAD))
        view: RenderedImage = renderer.render(pose, camera, width=spec.width, height=spec.height)
        rgb[index], label[index] = view.rgb, label_of[view.labels]
    return rgb, label


def render_frames(
    folder: Path, classes: Sequence[str], spec: FrameSetSpec, processes: int = 1
) -> Iterator[int]:
    """Render the missing frames; yields the number of frames done after each scene.

    Raises ValueError if the folder holds other frames, or the disk has no room for these.
    """
    folder.mkdir(parents=True, exist_ok=True)
    done = _count_rendered_scenes(folder, classes, spec)
    _check_disk(folder, spec, len(spec.seeds) - done)
    mode = "r+" if done else "w+"
    shape = (spec.count, spec.height, spec.width)
    rgb = np.lib.format.open_memmap(folder / "rgb.npy", mode, np.uint8, (*shape, 3))
    label = np.lib.format.open_memmap(folder / "label.npy", mode, np.uint8, shape)
    render = partial(render_scene, classes=tuple(classes), spec=spec)
    with worker_pool(processes) as pool:
        scenes = deque(pool.submit(render, seed) for seed in spec.seeds[done:])
        for number in range(done, len(spec.seeds)):
            images, labels = scenes.popleft().result()
            place = np.s_[number * spec.per_scene : (number + 1) * spec.per_scene]
            rgb[place], label[place] = images, labels
            rgb.flush()
            label.flush()
            _write_dataset_record(folder, classes, spec, scenes_done=number + 1)
            yield (number + 1) * spec.per_scene


def open_frames(folder: Path) -> FrameDataset:
    """The rendered frames of a folder, memory-mapped; FileNotFoundError if there are none."""
    try:
        record = json.loads((folder / "frames.json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise FileNotFoundError(f"no frames in {folder}: render them first") from None
    count = int(record["scenes_done"]) * int(record["per_scene"])
    try:
        rgb = np.load(folder / "rgb.npy", mmap_mode="r")[:count]
        label = np.load(folder / "label.npy", mmap_mode="r")[:count]
    except FileNotFoundError as problem:
        raise FileNotFoundError(
            f"{problem.filename} is missing: remove {folder} and render its frames again"
        ) from None
    return FrameDataset(rgb, label, tuple(record["classes"]), int(record["scenes_done"]))


def _dataset_record(classes: Sequence[str], spec: FrameSetSpec) -> dict[str, object]:
    return {
        "classes": list(classes),
        "seeds": list(spec.seeds),
        "per_scene": spec.per_scene,
        "size": [spec.width, spec.height],
        "style": spec.style.name,
    }


def _write_dataset_record(
    folder: Path, classes: Sequence[str], spec: FrameSetSpec, *, scenes_done: int
) -> None:
    text = json.dumps({**_dataset_record(classes, spec), "scenes_done": scenes_done})
    part = folder / "frames.json.part"
    part.write_text(text, encoding="utf-8")
    part.replace(folder / "frames.json")


def _count_rendered_scenes(folder: Path, classes: Sequence[str], spec: FrameSetSpec) -> int:
    path = folder / "frames.json"
    if not path.exists():
        return 0
    record = json.loads(path.read_text(encoding="utf-8"))
    done = int(record.pop("scenes_done"))
    wanted = _dataset_record(classes, spec)
    if other := [key for key in sorted({*record, *wanted}) if record.get(key) != wanted.get(key)]:
        raise ValueError(
            f"{folder} holds other frames than asked for, with other {other[0]}: choose another "
            "folder"
        )
    return done


def _check_disk(folder: Path, spec: FrameSetSpec, scenes: int) -> None:
    """Files are made sparse: a disk that fills up later would end the process by a signal."""
    needed = scenes * spec.per_scene * spec.width * spec.height * BYTES_PER_PIXEL
    free = shutil.disk_usage(folder).free
    if needed > free:
        raise ValueError(
            f"the frames need {needed / 1e9:.1f} GB of disk and {folder} has {free / 1e9:.1f} GB "
            "free: make room, or choose another folder"
        )
