"""Armchairs, upholstered all over."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import box, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.feet import WOODEN, feet, footing
from onemap_tools.train.variety.designs.upholstery import (
    other,
    puff,
    roll,
    seat_area,
    settled,
    tufted,
    wall,
)


def wingback(sampler: Sampler) -> Model:
    """A wing chair: a tall back with ears at the sides, scrolled arms, show-wood legs."""
    inner, depth, leg = sampler.size(0.5, 0.6), sampler.size(0.72, 0.86), sampler.size(0.12, 0.22)
    seat, height, r = sampler.size(0.42, 0.5), sampler.size(1.0, 1.2), sampler.size(0.055, 0.085)
    y, arm_z = depth / 2, seat + sampler.uniform(0.12, 0.2)
    width = inner + 4 * r
    cover = sampler.upholstery()
    body = [rounded_box((width - r, depth - 0.06, seat - leg - 0.1), (0, 0, leg), 0.025)]
    u = np.linspace(-1, 1, 15)
    crown = height - sampler.uniform(0.0, 0.12) * u**2
    path = np.stack([u * (inner / 2 + r), np.full(15, y - 0.07)], axis=1)
    body.append(wall(path, leg + 0.02, crown, 0.13, 0.05))
    reach, power = sampler.uniform(0.5, 0.75) * depth, sampler.uniform(2.0, 6.0)
    forward = np.linspace(0, 1, 12)
    top = crown[0] - 0.02 - (crown[0] - arm_z) * forward**power
    for side in (-1, 1):
        x = side * (inner / 2 + r)
        flare = side * 0.04 * np.sin(np.pi * forward)
        ear = np.stack([x + flare, y - 0.06 - forward * reach], axis=1)
        body.append(wall(ear, seat - 0.1, top, r * 1.3, 0.03))
        body.append(box((r * 1.3, depth - 0.08, arm_z - leg), (x, -0.01, leg)))
        body.append(roll(r, depth * 0.74, "y", (x + side * r * 0.3, -depth * 0.13, arm_z)))
    back = []
    if sampler.chance(0.4):
        pads = tufted((inner, 0.07, height - seat - 0.08), sampler.integer(2, 4), 4)
        back += [m.translated(0, y - 0.12, seat) for m in pads]
    elif sampler.chance(0.6):
        back.append(puff((inner - 0.02, 0.12, height - seat - 0.1), (0, y - 0.18, seat), 8, 5))
    cushion = [puff((inner - 0.01, depth - 0.13, 0.15), (0, -0.07, seat - 0.12), 9, 4)]
    wood = feet(sampler, width - 0.08, depth - 0.06, leg + 0.01, sampler.choice(WOODEN[2:]))
    return settled(
        assemble(
            "armchair",
            (cover, body),
            (other(sampler, cover, 0.8), cushion + back),
            (sampler.wood(), wood),
            support_surfaces=seat_area(inner, seat + 0.03),
        )
    )


def tub(sampler: Sampler) -> Model:
    """A tub chair: one round band of back and arms about a round seat."""
    width, depth = sampler.size(0.66, 0.82), sampler.size(0.64, 0.78)
    seat, height, low = sampler.size(0.4, 0.46), sampler.size(0.66, 0.82), sampler.size(0.0, 0.2)
    low = 0.0 if low < 0.05 else low
    thick, drop = sampler.size(0.07, 0.13), sampler.choice((0.0, 0.08, 0.16))
    opening = sampler.uniform(-0.35, 0.1) * np.pi
    angle = np.linspace(opening, np.pi - opening, 25)
    a, b = (width - thick) / 2, (depth - thick) / 2
    path = np.stack([a * np.cos(angle), b * np.sin(angle)], axis=1)
    forward = (path[:, 1].max() - path[:, 1]) / np.ptp(path[:, 1])
    ends = np.clip(height - drop * forward ** sampler.uniform(1, 3), seat + 0.06, None)
    cover = sampler.upholstery()
    body = [puff((width - thick, depth - thick, seat - low - 0.07), (0, 0, low), 2.2, 9)]
    cushion = [
        puff((width - 2 * thick, depth - 1.6 * thick, 0.15), (0, -0.02, seat - 0.12), 2.4, 4)
    ]
    if sampler.chance(0.3):  # upright channels inside the band
        inside = 1 - thick / width
        for at in np.linspace(opening, np.pi - opening, sampler.integer(9, 15)):
            x, y = a * inside * float(np.cos(at)), b * inside * float(np.sin(at))
            tall = float(np.interp(at, angle, ends)) - low - 0.01
            body.append(puff((0.1, 0.1, tall), (x, y, low), 2, 6, 12))
    else:
        body.append(wall(path, low, ends, thick, sampler.uniform(0.03, 0.06)))
    frame = footing(sampler, width * 0.74, depth * 0.74, low + 0.04)
    if low == 0.0:
        frame = (sampler.dark(), [])
    return settled(
        assemble(
            "armchair",
            (cover, body),
            (other(sampler, cover), cushion),
            frame,
            support_surfaces=seat_area(width - 2 * thick - 0.05, seat + 0.03),
        )
    )


def slipper_chair(sampler: Sampler) -> Model:
    """A low slipper chair: a wide padded seat and a buttoned or scooped back, no arms."""
    width, depth = sampler.size(0.58, 0.72), sampler.size(0.66, 0.8)
    seat, height, leg = sampler.size(0.38, 0.45), sampler.size(0.74, 0.95), sampler.size(0.1, 0.2)
    y, curl = depth / 2, sampler.uniform(0.0, 0.16)
    cover = sampler.upholstery()
    u = np.linspace(-1, 1, 15)
    path = np.stack([u * width / 2, y - 0.08 - curl * np.abs(u) ** 2.5], axis=1)
    crown = height - sampler.choice((0.0, 0.06, 0.14)) * np.abs(u) ** 3 - seat
    band = [wall(path - (0, y), -0.12, crown, 0.12, 0.05)]
    if curl < 0.03 and sampler.chance(0.7):
        pads = tufted((width * 0.9, 0.06, height - seat - 0.12), 3, 3)
        band += [m.translated(0, -0.13, 0.0) for m in pads]
    slant = sampler.uniform(3, 9)
    back = [m.rotated("x", -slant).translated(0, y, seat) for m in band]
    thick = seat - leg
    body = [rounded_box((width, depth - 0.1, thick * 0.55), (0, -0.03, leg), 0.02)]
    seat_pad = puff((width, depth - 0.16, thick * 0.6), (0, -0.07, seat - thick * 0.58), 8, 4)
    parts = [(cover, body + back), (other(sampler, cover), [seat_pad])]
    if sampler.chance(0.4):  # a straight skirt with open corners
        hem = [
            box((width * 0.9, 0.012, leg + 0.05), (0, s * (y - 0.07) - 0.03, 0.01)) for s in (-1, 1)
        ]
        hem += [
            box((0.012, depth * 0.7, leg + 0.05), (s * width / 2, -0.03, 0.01)) for s in (-1, 1)
        ]
        parts.append((other(sampler, cover, 0.8), hem))
    wood = feet(sampler, width - 0.04, depth - 0.14, leg + 0.02, sampler.choice(WOODEN[2:]))
    return settled(
        assemble(
            "armchair",
            *parts,
            (sampler.wood(), wood),
            support_surfaces=seat_area(width - 0.1, seat + 0.01),
        )
    )


def puffy_cube(sampler: Sampler) -> Model:
    """A squat chair of fat soft bodies: seat, back and two arms like pillows."""
    width, depth = sampler.size(0.8, 1.0), sampler.size(0.78, 0.94)
    seat, height, arm = sampler.size(0.36, 0.44), sampler.size(0.62, 0.8), sampler.size(0.17, 0.27)
    soft, y, back = sampler.uniform(3, 8), depth / 2, sampler.size(0.2, 0.28)
    arm_h = seat + sampler.uniform(0.1, max(height - seat, 0.12))
    inner, tiers = width - 2 * arm + 0.04, sampler.integer(1, 3)
    cover = sampler.upholstery()
    arms, core = [], []
    for k in range(tiers):
        tall = arm_h / tiers
        for side in (-1, 1):
            x = side * (width - arm) / 2
            arms.append(puff((arm, depth - 0.02, tall + 0.012), (x, 0, k * tall), soft, 4))
    core.append(puff((inner, back, height - 0.05), (0, y - back / 2, 0.05), soft, 4))
    for k in range(2):
        size = (inner, depth - back + 0.04, seat / 2 + 0.02)
        core.append(puff(size, (0, -back / 2, k * (seat / 2 - 0.01)), soft + 2, 4))
    if sampler.chance(0.4):
        rest = puff((inner - 0.04, 0.17, height - seat + 0.05), (0, 0, 0), 5, 2.8)
        core.append(rest.rotated("x", -10).translated(0, y - back - 0.06, seat - 0.03))
    return settled(
        assemble(
            "armchair",
            (cover, core),
            (other(sampler, cover, 0.8), arms),
            support_surfaces=seat_area(inner, seat),
        )
    )


def club_chair(sampler: Sampler) -> Model:
    """A leather club chair of the 1930s: huge rounded arms, a low thick back, a piped front."""
    inner, depth, arm = sampler.size(0.5, 0.58), sampler.size(0.84, 0.98), sampler.size(0.18, 0.25)
    seat, height, foot = sampler.size(0.4, 0.46), sampler.size(0.74, 0.88), sampler.size(0.04, 0.1)
    width, y, arm_h = inner + 2 * arm, depth / 2, sampler.size(0.56, 0.66)
    cover, slope = sampler.upholstery(), sampler.uniform(0.0, 0.14)
    body = [rounded_box((width - 0.08, depth - 0.1, seat - foot - 0.14), (0, 0, foot), 0.03)]
    along = np.linspace(-y, y, 9)
    for side in (-1, 1):
        bow = side * ((width - arm) / 2 - 0.03 * (along / y) ** 2)
        tops = arm_h + slope * (along / depth + 0.5) ** 2
        body.append(wall(np.stack([bow, along], axis=1), foot, tops, arm, arm * 0.46))
    u = np.linspace(-1, 1, 13)
    path = np.stack([u * (width / 2 - arm * 0.5), y - 0.1 - 0.05 * u**2], axis=1)
    body.append(wall(path, foot, height - 0.08 * u**2, 0.2, 0.09))
    cushion = [puff((inner - 0.01, depth - 0.2, 0.18), (0, -0.1, seat - 0.15), 8, 4)]
    lean = puff((inner - 0.01, 0.16, height - seat), (0, 0, 0), 6, 3.5)
    cushion.append(lean.rotated("x", -10).translated(0, y - 0.27, seat))
    return settled(
        assemble(
            "armchair",
            (cover, body),
            (other(sampler, cover, 0.8), cushion),
            footing(sampler, width - 0.08, depth - 0.06, foot + 0.02),
            support_surfaces=seat_area(inner, seat + 0.03),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "armchair": (
        wingback,
        tub,
        slipper_chair,
        puffy_cube,
        club_chair,
    ),
}
