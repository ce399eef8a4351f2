"""Mattresses, and duvets that are smooth, turned back, thrown open or crumpled."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, rounded_box
from onemap_simulator.generation.model import SupportSurface
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.upholstery import Group, puff, shell


def bed_size(sampler: Sampler) -> tuple[float, float]:
    """Width and length of a mattress: single, small double or double."""
    width = sampler.choice(
        (sampler.size(0.85, 1.05), sampler.size(1.2, 1.4), sampler.size(1.4, 1.8))
    )
    return width, sampler.size(1.92, 2.12)


def head_area(width: float, length: float, top: float) -> tuple[SupportSurface, ...]:
    """The head end of the mattress, where pillows lie."""
    x, y = width / 2 - 0.05, length / 2
    return (SupportSurface(-x, y - 0.55, x, y - 0.12, top),)


def _wrinkles(sampler: Sampler, x: F64, y: F64, strength: float) -> F64:
    height = np.zeros_like(x)
    for _ in range(6):
        angle, wave = sampler.uniform(0, np.pi), sampler.uniform(0.34, 0.9)
        phase = (x * np.cos(angle) + y * np.sin(angle)) * 2 * np.pi / wave
        height += wave * np.sin(phase + sampler.uniform(0, 7))
    return strength * height / 2


def draped(
    sampler: Sampler, width: float, ends: tuple[float, float], top: float, rough: float
) -> Mesh:
    """A cover over a bed of that width between two y, hanging down at both sides."""
    drop = min(sampler.uniform(0.08, 0.3), top - 0.08)
    over, foot = width / 2 + 0.015, ends[0]
    inner = np.linspace(-over + 0.03, over - 0.03, 13)
    hang = np.array([0.006, 0.05, 0.5, 1.0])
    slack = np.concatenate([-hang[::-1], np.zeros(13), hang])
    edge = over + np.array([0.0, 0.012, 0.018, 0.025])
    across = np.concatenate([-edge[::-1], inner, edge])
    skew = sampler.uniform(-0.3, 0.3) * rough * 20
    v = np.linspace(0, 1, 14)
    x, vv = np.meshgrid(across, v, indexing="ij")
    head = ends[1] + skew * 0.5 * x + rough * np.sin(x * 7 / width)
    y = foot + vv * (head - foot)
    z = top + 0.01 + np.abs(_wrinkles(sampler, x, y, rough)) * 1.4 * (slack == 0)[:, None]
    z -= np.abs(slack)[:, None] * drop * (1 + rough * 4 * np.sin(5 * y + 3 * np.sign(x)))
    x = x + np.sign(slack)[:, None] * 0.3 * np.abs(_wrinkles(sampler, x, y, rough + 0.02))
    sheet = np.stack([x, y, np.maximum(z, 0.06)], axis=-1)
    thick = sampler.uniform(0.025, 0.06)
    cover = shell(sheet, thick)
    return cover if cover.vertices[:, 2].max() > top + thick else shell(sheet, -thick)


def bedding(
    sampler: Sampler, width: float, length: float, base: float, y: float = 0.0
) -> tuple[list[Group], float]:
    """A mattress on ``base`` with covers in some state; and the height of the mattress."""
    thick, kind = sampler.size(0.14, 0.26), sampler.integer(0, 5)
    top, back, front = base + thick, y + length / 2, y - length / 2
    if sampler.chance(0.5):
        mattress = rounded_box((width, length, thick), (0, y, base), 0.05)
    else:
        mattress = puff((width, length, thick), (0, y, base), 16, 6)
    groups: list[Group] = [
        (sampler.pale() if sampler.chance(0.7) else sampler.fabric(), [mattress])
    ]
    cover = sampler.fabric()
    if kind <= 1:  # made, the upper edge maybe turned back
        head = back - sampler.uniform(0.1, 0.75)
        rough = sampler.uniform(0.0, 0.03)
        groups.append((cover, [draped(sampler, width, (front + 0.03, head), top, rough)]))
        if sampler.chance(0.6):
            size = (width + 0.05, sampler.uniform(0.18, 0.4), 0.05)
            turned = rounded_box(size, (0, head - size[1] / 2 + 0.02, top + 0.05 + rough), 0.024)
            groups.append((cover if sampler.chance(0.4) else sampler.pale(), [turned]))
    elif kind <= 3:  # slept in
        head = front + length * sampler.uniform(0.45, 0.8)
        rough = sampler.uniform(0.04, 0.09)
        groups.append((cover, [draped(sampler, width, (front + 0.05, head), top, rough)]))
    elif kind == 4:  # a blanket or a folded duvet across the foot end
        deep, high = sampler.uniform(0.35, 0.7), sampler.uniform(0.05, 0.09)
        at = front + deep / 2 + sampler.uniform(0.05, 0.3)
        folds = [
            puff(
                (width * 0.98, deep - 0.03 * k, high), (0, at, top - 0.015 + k * high * 0.85), 14, 4
            )
            for k in range(sampler.integer(1, 3))
        ]
        groups.append((cover, folds))
    return groups, top
