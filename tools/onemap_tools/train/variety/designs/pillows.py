"""Pillows: square and piped, bolsters, chopped, flattened, round and pleated."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, cylinder, ellipsoid, from_faces, lathe, tube
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.upholstery import loft, other, settled, shell


def _stuffed(outline: F64, bulge: F64, thickness: float) -> list[Mesh]:
    """Two bulging halves over a grid of plan points (U, V, 2), joined at their edges."""
    index = np.arange(bulge.size).reshape(bulge.shape)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)
    flat = quads.reshape(-1, 4)
    faces = np.concatenate([flat[:, [0, 1, 2]], flat[:, [0, 2, 3]]])
    halves = []
    for side in (1, -1):
        points = np.concatenate([outline, side * bulge[..., None] * thickness / 2], axis=-1)
        halves.append(from_faces(points.reshape(-1, 3), faces[:, ::side]))
    return halves


def _grid(count: int = 13) -> tuple[F64, F64]:
    u, v = np.meshgrid(*[np.sin(np.linspace(-np.pi / 2, np.pi / 2, count))] * 2, indexing="ij")
    return u, v


def _posed(sampler: Sampler, meshes: list[Mesh], upright: float) -> list[Mesh]:
    """The meshes lying, or leaning back on their lower edge, standing on z = 0."""
    if sampler.chance(upright):
        slant = sampler.uniform(55, 80)
        meshes = [m.rotated("x", slant) for m in meshes]
    low = min(float(m.vertices[:, 2].min()) for m in meshes)
    return [m.translated(0, 0, -low) for m in meshes]


def square_cushion(sampler: Sampler) -> Model:
    """A square or oblong cushion with pointed corners, piping round its edge, maybe a button."""
    width, thick = sampler.size(0.36, 0.6), sampler.size(0.1, 0.2)
    depth = width if sampler.chance(0.6) else sampler.size(0.28, 0.42)
    u, v = _grid()
    pinch, power = sampler.uniform(0.03, 0.16), sampler.uniform(0.4, 0.8)
    x = u * width / 2 * (1 - pinch * (1 - v**2))
    y = v * depth / 2 * (1 - pinch * (1 - u**2))
    dent = sampler.choice((0.0, 0.0, 0.55))
    bulge = ((1 - u**2) * (1 - v**2)) ** power * (1 - dent * np.exp(-20 * (u**2 + v**2)))
    cover = sampler.fabric()
    soft, trim = _stuffed(np.stack([x, y], axis=-1), bulge, thick), []
    if sampler.chance(0.6):
        rim = np.stack([x, y, np.zeros_like(x)], axis=-1)
        edge = np.concatenate([rim[:-1, 0], rim[-1, :-1], rim[:0:-1, -1], rim[0, :0:-1]])
        trim.append(tube(edge, sampler.uniform(0.004, 0.009), 5, closed=True))
    if dent:
        trim += [
            ellipsoid((0.018, 0.018, 0.01), (0, 0, s * thick / 2 * (1 - dent)), 8) for s in (-1, 1)
        ]
    posed = _posed(sampler, soft + trim, 0.5)
    return settled(assemble("pillow", (cover, posed[:2]), (other(sampler, cover, 0.3), posed[2:])))


def bolster(sampler: Sampler) -> Model:
    """A long round bolster, flat at the ends with a button, or gathered like a sweet."""
    radius, length = sampler.size(0.075, 0.13), sampler.size(0.4, 0.9)
    cover, half = sampler.fabric(), length / 2
    kind, trim = sampler.integer(0, 2), []
    if kind == 0:  # flat ends, piped
        bulge = 1 + 0.06 * np.cos(np.linspace(-1.4, 1.4, 7))
        profile = [
            (radius * float(b), z) for b, z in zip(bulge, np.linspace(-half, half, 7), strict=True)
        ]
        trim = [
            cylinder(radius * 0.16, 0.02, (0, 0, s * (half + 0.002) - 0.01), 8) for s in (-1, 1)
        ]
    elif kind == 1:  # domed ends
        t = np.linspace(-np.pi / 2, np.pi / 2, 13)
        z = np.sign(np.sin(t)) * np.abs(np.sin(t)) ** 0.35 * half
        profile = [
            (radius * max(float(np.cos(a)) ** 0.5, 0.03), float(h))
            for a, h in zip(t, z, strict=True)
        ]
    else:  # gathered: neck and frill
        body = [(0.9, 0.86), (1.0, 0.6), (1.03, 0.3), (1.03, 0.0)]
        upper = [(r * radius, h * half) for r, h in [(0.75, 1.12), (0.25, 0.97), *body]]
        profile = [(r, -z) for r, z in upper[:-1]] + upper[::-1]
        trim = [
            lathe([(radius * 0.3, s * half * 0.95), (radius * 0.3, s * half * 0.99)][::s])
            for s in (-1, 1)
        ]
    meshes = [lathe(profile, segments=18), *trim]
    sag = sampler.uniform(0.85, 1.0)
    turned = [m.rotated("y", 90).scaled(1, 1, sag) for m in meshes]
    low = min(float(m.vertices[:, 2].min()) for m in turned)
    turned = [m.translated(0, 0, -low) for m in turned]
    return settled(
        assemble("pillow", (cover, turned[:1]), (other(sampler, cover, 0.3), turned[1:]))
    )


def chopped_cushion(sampler: Sampler) -> Model:
    """A soft feather cushion that stands leaning, its upper edge chopped to a V."""
    width, height = sampler.size(0.42, 0.6), sampler.size(0.4, 0.55)
    thick, chop = sampler.size(0.13, 0.22), sampler.uniform(0.2, 0.4)
    u, v = _grid(15)
    v_cut = chop * np.exp(-((u / sampler.uniform(0.25, 0.45)) ** 2)) * ((v + 1) / 2) ** 2
    x = u * width / 2 * (1 - 0.06 * (1 - v**2) + 0.025 * (1 - v))
    y = (v - 1.2 * v_cut) * height / 2 * (1 - 0.05 * (1 - u**2))
    crease = 1 - 0.75 * np.exp(-((u / 0.22) ** 2)) * np.clip(v, 0, 1)
    sag = 1 + 0.25 * np.clip(-v, 0, 1)
    bulge = ((1 - u**2) * (1 - v**2)) ** 0.5 * crease * sag
    soft = _stuffed(np.stack([x, y], axis=-1), bulge, thick)
    slant = sampler.uniform(60, 82)
    meshes = [m.rotated("x", slant) for m in soft]
    low = min(float(m.vertices[:, 2].min()) for m in meshes)
    return settled(
        assemble("pillow", (sampler.fabric(), [m.translated(0, 0, -low) for m in meshes]))
    )


def flat_pillow(sampler: Sampler) -> Model:
    """A slept-on bed pillow: wide, thin, a hollow in the middle, a flap or flange at the edge."""
    width, depth, thick = (
        sampler.size(0.55, 0.8),
        sampler.size(0.38, 0.52),
        sampler.size(0.08, 0.16),
    )
    u, v = _grid(15)
    at, hollow = sampler.uniform(-0.25, 0.25), sampler.uniform(0.1, 0.6)
    lumps = 1 + 0.1 * np.sin(4 * u + sampler.uniform(0, 6)) * np.cos(3 * v + sampler.uniform(0, 6))
    bulge = ((1 - u**4) * (1 - v**4)) ** 0.6 * lumps
    bulge *= 1 - hollow * np.exp(-5 * ((u - at) ** 2 + v**2))
    outline = np.stack([u * width / 2 * (1 - 0.05 * (1 - v**2)), v * depth / 2], axis=-1)
    cover = sampler.pale() if sampler.chance(0.5) else sampler.fabric()
    soft = _stuffed(outline, bulge, thick)
    trim = []
    if sampler.chance(0.5):  # a flat hem all round
        grid = np.stack([u * (width / 2 + 0.045), v * (depth / 2 + 0.045), 0 * u], axis=-1)
        grid[..., 2] = 0.008 * np.sin(9 * u + 7 * v)
        trim.append(shell(grid, 0.006))
    posed = _posed(sampler, soft + trim, 0.3)
    return settled(assemble("pillow", (cover, posed[:2]), (other(sampler, cover, 0.6), posed[2:])))


def round_cushion(sampler: Sampler) -> Model:
    """A round cushion: a pleated disc with a button, or a thick drum with piping."""
    radius, thick = sampler.size(0.18, 0.26), sampler.size(0.09, 0.16)
    pleats, ripple = sampler.integer(8, 16), sampler.choice((0.0, 0.05))
    angle = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    drum = sampler.chance(0.35)
    share = np.array([0.02, 0.15, 0.45, 0.8, 0.95, 1.0, 0.95, 0.8, 0.45, 0.15, 0.02])
    height = np.array([-0.25, -0.32, -0.5, -0.4, -0.2, 0, 0.2, 0.4, 0.5, 0.32, 0.25])
    if drum:
        height = np.clip(height * 3, -0.5, 0.5)
    wave = 1 + ripple * np.sign(np.cos(pleats * angle))
    rings = np.empty((len(share), len(angle), 3))
    rings[..., 0] = np.outer(share, np.cos(angle)) * radius
    rings[..., 1] = np.outer(share, np.sin(angle)) * radius
    rings[..., 2] = np.outer(height, wave) * thick
    soft, middle = [loft(rings)], (0.5 if drum else 0.25) * thick
    buttons = [ellipsoid((0.022, 0.022, 0.012), (0, 0, s * middle), 10) for s in (-1, 1)]
    posed = _posed(sampler, soft + buttons, 0.5)
    cover = sampler.fabric()
    return settled(assemble("pillow", (cover, posed[:1]), (other(sampler, cover, 0.4), posed[1:])))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "pillow": (
        square_cushion,
        bolster,
        chopped_cushion,
        flat_pillow,
        round_cushion,
    ),
}
