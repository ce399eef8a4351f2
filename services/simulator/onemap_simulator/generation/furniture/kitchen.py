"""Kitchen cabinets and sinks that stand in a row."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.storage import handle_bar
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    box_between,
    cylinder,
    rod,
    rounded_box,
    tube,
)
from onemap_simulator.generation.model import Material, Model, SupportSurface, assemble
from onemap_simulator.generation.sampler import Sampler

DEPTH_M = 0.6
COUNTER_M = 0.9
FRONT_Y = -DEPTH_M / 2
KitchenLook = tuple[Material, Material, Material]  # body, worktop, handles


def kitchen_look(sampler: Sampler) -> KitchenLook:
    """Body, worktop and handles that all cabinets of one kitchen share."""
    worktop = (
        sampler.wood() if sampler.chance(0.5) else sampler.material("marble", 0.8, sampler.colour())
    )
    return (sampler.wood(), worktop, sampler.metal())


def kitchen_cabinet(sampler: Sampler, width: float, look: KitchenLook) -> Model:
    """A base cabinet with doors or drawers under a worktop; ``look``: body, worktop, handles."""
    body, worktop, metal = look
    meshes = [box((width, DEPTH_M - 0.03, COUNTER_M - 0.14), (0, 0.015, 0.1))]
    meshes.append(box((width, DEPTH_M - 0.1, 0.1), (0, 0.03, 0)))
    leaves, handles = _fronts(sampler, width, (0.11, COUNTER_M - 0.05), FRONT_Y)
    board = box((width, DEPTH_M + 0.02, 0.04), (0, 0, COUNTER_M - 0.04))
    return assemble(
        "kitchen cabinet",
        (body, [*meshes, *leaves]),
        (worktop, [board]),
        (metal, handles),
        support_surfaces=(SupportSurface(-width / 2, -0.2, width / 2, 0.26, COUNTER_M),),
    )


def wall_cabinet(sampler: Sampler, width: float, look: KitchenLook) -> Model:
    """A shallow cabinet to hang above a worktop; z = 0 is its underside."""
    height, depth = 0.62, 0.34
    leaves, handles = _fronts(sampler, width, (0.01, height - 0.01), -depth / 2, doors_only=True)
    body = box((width, depth - 0.03, height), (0, 0.015, 0))
    return assemble("kitchen cabinet", (look[0], [body, *leaves]), (look[2], handles))


def _fronts(
    sampler: Sampler, width: float, z: tuple[float, float], y: float, *, doors_only: bool = False
) -> tuple[list[Mesh], list[Mesh]]:
    low, high = z
    leaves, handles = [], []
    if not doors_only and sampler.chance(0.4):
        count = sampler.integer(3, 4)
        tall = (high - low) / count
        for row in range(count):
            at = (0.0, y + 0.012, low + row * tall)
            leaves.append(rounded_box((width - 0.012, 0.03, tall - 0.012), at, 0.006))
            handles.append(
                handle_bar(sampler, width * 0.45, (0, y, low + (row + 0.75) * tall), False)
            )
        return leaves, handles
    count = 2 if width > 0.65 else 1
    each = width / count
    for index in range(count):
        x = (index - (count - 1) / 2) * each
        leaves.append(rounded_box((each - 0.012, 0.03, high - low), (x, y + 0.012, low), 0.006))
        side = 1 if index == 0 else -1
        at = (x + side * (each / 2 - 0.06), y, low + 0.16 if doors_only else high - 0.16)
        handles.append(handle_bar(sampler, 0.16, at, True))
    return leaves, handles


def kitchen_sink(sampler: Sampler, width: float, look: KitchenLook) -> Model:
    """A basin with an apron front, set in the worktop's row, with an arched tap."""
    basin = (
        sampler.ceramic()
        if sampler.chance(0.5)
        else sampler.material("brushed", 0.5, sampler.grey(0.6, 0.85))
    )
    wall, low, high = 0.035, COUNTER_M - 0.24, COUNTER_M + 0.02
    y0, y1, x = FRONT_Y - 0.02, DEPTH_M / 2, width / 2
    meshes = [
        box_between((-x, y0, low), (x, y1, low + 0.05)),
        box_between((-x, y0, low), (x, y0 + wall, high)),
        box_between((-x, y1 - 0.14, low), (x, y1, high)),
        box_between((-x, y0, low), (-x + wall, y1, high)),
        box_between((x - wall, y0, low), (x, y1, high)),
    ]
    cabinet = box_between((-x, FRONT_Y + 0.02, 0.0), (x, y1, low))
    leaves, handles = _fronts(sampler, width, (0.1, low - 0.01), FRONT_Y, doors_only=True)
    drain = cylinder(0.035, 0.01, (0, 0, low + 0.05), 12)
    return assemble(
        "sink",
        (basin, meshes),
        (look[0], [cabinet, *leaves]),
        (look[2], handles),
        (sampler.metal(), [*tap(sampler, (0, y1 - 0.07, high)), drain]),
    )


def tap(sampler: Sampler, at: tuple[float, float, float]) -> list[Mesh]:
    """An arched or angular tap that reaches towards -y, with two handles."""
    reach, rise = sampler.size(0.15, 0.2), sampler.size(0.18, 0.28)
    if sampler.chance(0.6):
        angle = np.linspace(0, np.pi, 8)
        arch = [(0.0, -reach / 2 * (1 - np.cos(a)), rise * 0.6 + 0.1 * np.sin(a)) for a in angle]
        meshes = [tube([(0, 0, 0), (0, 0, rise * 0.3), *arch], 0.014)]
    else:
        meshes = [rod((0, 0, 0), (0, 0, rise * 0.7), 0.018)]
        meshes.append(rod((0, 0.015, rise * 0.68), (0, -reach, rise * 0.68), 0.014))
    for side in (-1, 1):
        meshes.append(cylinder(0.018, 0.06, (side * 0.09, 0, 0), 8))
        meshes.append(box((0.06, 0.014, 0.014), (side * 0.09, 0, 0.055)))
    return [mesh.translated(*at) for mesh in meshes]
