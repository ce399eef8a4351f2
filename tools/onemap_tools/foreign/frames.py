"""The set's pictures: camera poses in every apartment, images and labels; a function of seeds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64, U8
from onemap_simulator.rendering.camera_poses import CameraPoseRange, sample_camera_poses
from onemap_tools.foreign.furnishing import ShapeRota, apartment, furnish
from onemap_tools.foreign.lit_scene import LitScene
from onemap_tools.foreign.plans import PLANS
from onemap_tools.foreign.renderer import CameraLook, ForeignRenderer
from onemap_tools.processes.worker_pool import worker_pool

FOREIGN_SEED = 70_200_417  # of everything in the set; no training and no choice may use it
FURNISHINGS = 3  # of each plan, so that every shape occurs
NO_CLASS = 255  # pixels of no class: nothing hit, or a thing without a name in the list
# As the other sets are seen: most from the simulated robot's camera, the rest from elsewhere.
FOV_RAD = (1.05, 1.65)
ROBOT_VIEWS = CameraPoseRange()
OTHER_VIEWS = CameraPoseRange(camera_height_m=(0.4, 1.6), pitch_rad=(-0.3, 0.6))
OTHER_SHARE = 0.3


@dataclass(frozen=True, slots=True)
class ForeignSetSpec:
    """Which pictures: ``pictures`` of each of PLANS in each of ``furnishings`` furnishings."""

    furnishings: int = FURNISHINGS
    pictures: int = 30
    width: int = 320
    height: int = 240

    @property
    def scenes(self) -> tuple[tuple[int, int], ...]:
        """Index of the plan and of the furnishing of every scene."""
        return tuple((p, f) for f in range(self.furnishings) for p in range(len(PLANS)))


@dataclass(frozen=True, slots=True)
class LabelledFrame:
    """rgb (H, W, 3) uint8 and label (H, W) uint8: index into the words asked for, or NO_CLASS."""

    rgb: U8
    label: U8


def foreign_scene(plan: int, furnishing: int) -> LitScene:
    """An apartment of the set. Shapes go round over all scenes before it."""
    rota = ShapeRota()
    for earlier_plan, earlier in ForeignSetSpec(furnishing + 1).scenes:
        if (earlier_plan, earlier) == (plan, furnishing):
            break
        for room in PLANS[earlier_plan].rooms:
            for slot in room.slots:
                rota.take(slot)
    return apartment(PLANS[plan], rota, (FOREIGN_SEED, plan, furnishing))


def render_foreign(
    scene: tuple[int, int], words: Sequence[str], spec: ForeignSetSpec
) -> list[LabelledFrame]:
    """All pictures of one scene (plan, furnishing), labelled with the words."""
    plan, furnishing = scene
    lit = foreign_scene(plan, furnishing)
    index_of = {word: index for index, word in enumerate(words)}
    table = np.array([index_of.get(o.category, NO_CLASS) for o in lit.scene.objects] + [NO_CLASS])
    renderer = ForeignRenderer(lit, CameraLook(PLANS[plan].balance))
    rng = np.random.default_rng([FOREIGN_SEED, plan, furnishing, spec.pictures])
    frames = []
    for pose in _poses(lit, rng, spec.pictures):
        camera = Intrinsics.from_fov(spec.width, spec.height, float(rng.uniform(*FOV_RAD)))
        labels = renderer.labels(pose, camera, spec.width, spec.height)
        rgb = renderer.render(pose, camera, width=spec.width, height=spec.height, rng=rng)
        frames.append(LabelledFrame(rgb, table[labels].astype(np.uint8)))
    return frames


def _poses(lit: LitScene, rng: np.random.Generator, count: int) -> list[F64]:
    other = round(count * OTHER_SHARE)
    poses = sample_camera_poses(lit.scene, rng, count - other, ROBOT_VIEWS)
    return poses + sample_camera_poses(lit.scene, rng, other, OTHER_VIEWS)


def foreign_frames(
    words: Sequence[str], spec: ForeignSetSpec, processes: int = 1
) -> Iterator[list[LabelledFrame]]:
    """The pictures of every scene, in order; the number of processes does not change them."""
    render = partial(render_foreign, words=tuple(words), spec=spec)
    if processes == 1:
        yield from map(render, spec.scenes)
        return
    pool = worker_pool(processes)
    try:
        yield from pool.map(render, spec.scenes)
    finally:
        pool.shutdown(cancel_futures=True)


def shown_shapes(spec: ForeignSetSpec) -> dict[str, set[int]]:
    """Which shapes of each class stand in the set's apartments."""
    rota, shown = ShapeRota(), dict[str, set[int]]()
    for plan, furnishing in spec.scenes:
        for placed in furnish(PLANS[plan], rota, (FOREIGN_SEED, plan, furnishing)):
            shown.setdefault(placed.slot.category, set()).add(placed.shape)
    return shown
