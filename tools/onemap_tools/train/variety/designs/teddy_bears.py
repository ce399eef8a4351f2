"""Teddy bears: sitting, standing, lying, jointed antique, long-limbed and flat-faced ones."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, Vec, box, ellipsoid, rounded_box, torus
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler


def _fur(sampler: Sampler) -> Material:
    hue = sampler.uniform(0.45, 1.15)
    brown = (0.7 * hue, 0.5 * hue, 0.3 * hue)
    return sampler.material("noise", 0.15, brown if sampler.chance(0.5) else sampler.colour())


def _head(sampler: Sampler, r: float, at: Vec) -> tuple[list[Mesh], list[Mesh], list[Mesh]]:
    """Fur, pale and dark parts of a head of radius r: ears, muzzle, nose, eyes; it faces -y."""
    x, y, z = at
    ear, apart = r * sampler.uniform(0.34, 0.5), sampler.uniform(0.66, 0.86)
    snout = sampler.uniform(0.3, 0.55)
    fur = [ellipsoid((r * sampler.uniform(1.0, 1.15), r * 0.95, r * 0.92), at, 12)]
    pale = [ellipsoid((r * 0.46, r * snout, r * 0.36), (x, y - r * 0.82, z - r * 0.22), 10)]
    dark = [ellipsoid((r * 0.17, r * 0.1, r * 0.12), (x, y - r * (0.8 + snout), z - r * 0.1), 6)]
    for s in (-1, 1):
        fur.append(ellipsoid((ear, ear * 0.5, ear), (x + s * r * apart, y, z + r * 0.72), 10))
        pale.append(
            ellipsoid(
                (ear * 0.65, ear * 0.3, ear * 0.65),
                (x + s * r * apart, y - ear * 0.3, z + r * 0.72),
                8,
            )
        )
        dark.append(
            ellipsoid(
                (r * 0.11, r * 0.08, r * 0.11), (x + s * r * 0.36, y - r * 0.86, z + r * 0.16), 6
            )
        )
    return fur, pale, dark


def _limb(size: Vec, end: Vec, axis: str, degrees: float) -> Mesh:
    """An ellipsoid that hangs down from its shoulder at ``end``, turned about an axis there."""
    limb = ellipsoid(size, (0, 0, -size[2] * 0.8), 10)
    return limb.rotated(axis, degrees).translated(*end)


def _finished(
    sampler: Sampler,
    parts: tuple[list[Mesh], list[Mesh], list[Mesh]],
    extra: list[tuple[Material, list[Mesh]]],
    tall: float,
) -> Model:
    """Scaled to a height and set down on the floor about the origin."""
    groups = [
        (_fur(sampler), parts[0]),
        (sampler.material("noise", 0.15, sampler.grey(0.7, 0.95, tint=0.25)), parts[1]),
        (sampler.dark(), parts[2]),
        *extra,
    ]
    points = [m.vertices for _, ms in groups for m in ms]
    low = [min(float(p[:, k].min()) for p in points) for k in range(3)]
    high = [max(float(p[:, k].max()) for p in points) for k in range(3)]
    s = tall / max(high[k] - low[k] for k in range(3))
    x, y, z = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]
    return assemble(
        "teddy bear",
        *((m, [p.translated(-x, -y, -z).scaled(s, s, s) for p in ms]) for m, ms in groups),
    )


def _scarf(sampler: Sampler, r: float, z: float) -> list[tuple[Material, list[Mesh]]]:
    """A ribbon with a bow, a scarf with ends, or nothing around the neck."""
    kind = sampler.integer(0, 2)
    ring = torus(r, r * 0.22, (0, 0, z), 14)
    if kind == 0:
        bow = [
            ellipsoid((r * 0.5, r * 0.14, r * 0.3), (s * r * 0.5, -r * 1.25, z), 8) for s in (-1, 1)
        ]
        return [(sampler.fabric(), [ring, *bow, ellipsoid((r * 0.16,) * 3, (0, -r * 1.3, z), 6)])]
    if kind == 1:
        ends = [
            box((r * 0.4, r * 0.12, r * 1.2), (r * x, -r * 1.22, z - r * 1.2)) for x in (0.1, 0.55)
        ]
        return [(sampler.fabric(), [ring, *ends])]
    return []


def sitting_bear(sampler: Sampler) -> Model:
    """A plump sitting bear with short outstretched legs, arms down or wide, a bow or a scarf."""
    fat, big = sampler.uniform(0.85, 1.25), sampler.uniform(0.09, 0.125)
    fur, pale, dark = _head(sampler, big, (0, -0.01, 0.22 + big * 0.8))
    fur.append(ellipsoid((0.1 * fat, 0.09 * fat, 0.125), (0, 0, 0.125), 14))
    pale.append(ellipsoid((0.065 * fat, 0.03, 0.08), (0, -0.075 * fat, 0.12), 10))
    wide, spread = sampler.uniform(15, 85), sampler.uniform(10, 30)
    for s in (-1, 1):
        fur.append(_limb((0.036, 0.036, 0.08), (s * 0.075 * fat, -0.02, 0.21), "y", -s * wide))
        leg = ellipsoid((0.048, 0.095, 0.046), (0, -0.08, 0.048), 10)
        fur.append(leg.rotated("z", s * spread).translated(s * 0.06, -0.03, 0))
        sole = ellipsoid((0.036, 0.012, 0.036), (0, -0.172, 0.05), 8)
        pale.append(sole.rotated("z", s * spread).translated(s * 0.06, -0.03, 0))
    extra = _scarf(sampler, 0.062, 0.235)
    return _finished(sampler, (fur, pale, dark), extra, sampler.size(0.3, 0.5))


def standing_bear(sampler: Sampler) -> Model:
    """A bear on its feet in a jumper or trousers, one arm raised at times."""
    fat, big = sampler.uniform(0.85, 1.15), sampler.uniform(0.08, 0.11)
    fur, pale, dark = _head(sampler, big, (0, 0, 0.38 + big * 0.8))
    trunk = ellipsoid((0.088 * fat, 0.075 * fat, 0.12), (0, 0, 0.27), 14)
    jumper = [ellipsoid((0.095 * fat, 0.083 * fat, 0.1), (0, 0, 0.29), 14)]
    fur.append(trunk)
    arms = (sampler.uniform(20, 60), sampler.choice([30.0, 140.0]))
    for s, angle in zip((-1, 1), arms, strict=True):
        arm = _limb((0.034, 0.034, 0.085), (s * 0.07 * fat, 0, 0.35), "y", -s * angle)
        fur.append(arm)
        jumper.append(_limb((0.04, 0.04, 0.05), (s * 0.07 * fat, 0, 0.35), "y", -s * angle))
        fur.append(ellipsoid((0.045, 0.045, 0.1), (s * 0.05, 0, 0.1), 10))
        fur.append(ellipsoid((0.045, 0.065, 0.03), (s * 0.05, -0.03, 0.03), 10))
    pale.append(ellipsoid((0.06 * fat, 0.03, 0.06), (0, -0.06 * fat, 0.23), 8))
    extra = [(sampler.fabric(), jumper)] if sampler.chance(0.6) else _scarf(sampler, 0.055, 0.385)
    return _finished(sampler, (fur, pale, dark), extra, sampler.size(0.34, 0.55))


def jointed_bear(sampler: Sampler) -> Model:
    """An antique bear, sitting: long curved arms and feet, hump, small head with a long snout."""
    fur, pale, dark = _head(sampler, 0.075, (0, -0.02, 0.33))
    fur += [
        ellipsoid((0.08, 0.075, 0.14), (0, 0, 0.15), 12),
        ellipsoid((0.05, 0.05, 0.05), (0, 0.055, 0.24), 10),
        ellipsoid((0.035, 0.06, 0.03), (0, -0.1, 0.31), 8),
    ]
    dark.append(ellipsoid((0.014, 0.01, 0.01), (0, -0.16, 0.315), 6))
    forward, up = sampler.uniform(20, 75), sampler.uniform(0, 20)
    for s in (-1, 1):
        arm = _limb((0.028, 0.03, 0.11), (s * 0.085, 0, 0.25), "x", -forward)
        fur.append(arm)
        leg = ellipsoid((0.036, 0.11, 0.036), (s * 0.07, -0.12, 0.05), 10)
        fur.append(leg)
        foot = ellipsoid((0.032, 0.024, 0.06), (s * 0.075, -0.225, 0.06), 8).rotated(
            "z", s * up * 0.3
        )
        pale.append(foot)
    extra = _scarf(sampler, 0.05, 0.27)
    return _finished(sampler, (fur, pale, dark), extra, sampler.size(0.3, 0.46))


def lying_bear(sampler: Sampler) -> Model:
    """A flat plush bear on its belly: limbs out to all sides, its head up front."""
    fat = sampler.uniform(0.85, 1.2)
    fur, pale, dark = _head(sampler, 0.095, (0, -0.15, 0.1))
    fur.append(ellipsoid((0.11 * fat, 0.15, 0.07), (0, 0.02, 0.068), 14))
    fore, rear = sampler.uniform(20, 70), sampler.uniform(20, 60)
    for s in (-1, 1):
        arm = ellipsoid((0.042, 0.095, 0.038), (0, -0.07, 0), 10).rotated("z", s * fore)
        fur.append(arm.translated(s * 0.08 * fat, -0.07, 0.04))
        leg = ellipsoid((0.05, 0.1, 0.044), (0, 0.07, 0), 10).rotated("z", -s * rear)
        fur.append(leg.translated(s * 0.06 * fat, 0.1, 0.045))
        sole = ellipsoid((0.036, 0.014, 0.034), (0, 0.165, 0), 8).rotated("z", -s * rear)
        pale.append(sole.translated(s * 0.06 * fat, 0.1, 0.046))
    fur.append(ellipsoid((0.03, 0.03, 0.03), (0, 0.17, 0.09), 8))
    return _finished(sampler, (fur, pale, dark), [], sampler.size(0.36, 0.55))


def blocky_bear(sampler: Sampler) -> Model:
    """A modern cushion-like bear: square soft body and head in one, stub limbs, button eyes."""
    w, h = sampler.uniform(0.2, 0.28), sampler.uniform(0.3, 0.4)
    d = w * sampler.uniform(0.5, 0.75)
    fur = [rounded_box((w, d, h * 0.52), (0, 0, 0.02), d * 0.4)]
    head_w = w * sampler.uniform(1.0, 1.25)
    z = h * 0.46
    fur.append(rounded_box((head_w, d * 1.05, h * 0.52), (0, -0.01, z), d * 0.42))
    front = -0.01 - d * 0.525
    pale = [rounded_box((w * 0.45, 0.05, h * 0.2), (0, front, z + h * 0.08), 0.024)]
    pale.append(rounded_box((w * 0.6, 0.03, h * 0.3), (0, -d / 2, 0.06), 0.014))
    dark = [ellipsoid((0.02, 0.012, 0.014), (0, front - 0.026, z + h * 0.2), 8)]
    for s in (-1, 1):
        dark.append(
            ellipsoid((0.013, 0.01, 0.013), (s * head_w * 0.26, front - 0.003, z + h * 0.3), 8)
        )
        fur.append(ellipsoid((0.05, 0.03, 0.05), (s * head_w * 0.36, 0, z + h * 0.53), 10))
        fur.append(
            rounded_box((0.07, 0.08, 0.13), (0, 0, -0.13), 0.033)
            .rotated("y", -s * sampler.uniform(15, 70))
            .translated(s * w * 0.46, 0, h * 0.42)
        )
        fur.append(rounded_box((0.085, 0.16, 0.075), (s * w * 0.3, -d * 0.5 - 0.03, 0), 0.035))
        pale.append(ellipsoid((0.03, 0.01, 0.026), (s * w * 0.3, -d * 0.5 - 0.11, 0.037), 8))
    return _finished(sampler, (fur, pale, dark), [], sampler.size(0.32, 0.5))
