"""Boxes: cartons, shoe and gift boxes, crates, plastic storage, stacks."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, rod, rounded_box, torus, tube
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler

Size = tuple[float, float, float]


def _card(sampler: Sampler) -> Material:
    tan = sampler.uniform(0.7, 1.15)
    if sampler.chance(0.6):
        return sampler.material("noise", 0.3, (0.72 * tan, 0.55 * tan, 0.36 * tan))
    return sampler.plastic() if sampler.chance(0.6) else sampler.pale()


def _walls(size: Size, t: float) -> list[Mesh]:
    """A floor and four walls of thickness t; the corners overlap nowhere."""
    w, d, h = size
    return [
        box((w - 2 * t, d - 2 * t, t)),
        *(box((w, t, h), (0, s * (d - t) / 2, 0)) for s in (-1, 1)),
        *(box((t, d - 2 * t, h), (s * (w - t) / 2, 0, 0)) for s in (-1, 1)),
    ]


def _flap(size: tuple[float, float], side: int, edge: float, z: float, angle: float) -> list[Mesh]:
    """A flap hinged at y = side * edge: 0 degrees lies flat inwards, 90 is upright."""
    w, d = size
    flat = box((w, d, 0.005), (0, -side * d / 2, 0))
    return [flat.rotated("x", -side * angle).translated(0, side * edge, z)]


def open_carton(sampler: Sampler) -> Model:
    """An open cardboard box: flaps up, folded out or hanging, things or packing paper in it."""
    w, d, h = sampler.size(0.3, 0.55), sampler.size(0.25, 0.42), sampler.size(0.18, 0.38)
    card = _walls((w, d, h), 0.006)
    wide, narrow = sampler.uniform(70, 195), sampler.uniform(85, 190)
    for side in (-1, 1):
        long, short_angle = wide + sampler.uniform(-12, 12), narrow + sampler.uniform(-12, 12)
        card += _flap((w - 0.01, d * 0.42), side, d / 2 - 0.003, h, long)
        short = _flap((d - 0.02, w * 0.3), side, w / 2 - 0.003, h - 0.002, short_angle)
        card += [m.rotated("z", -90) for m in short]
    groups = [(_card(sampler), card)]
    kind = sampler.integer(0, 3)
    if kind == 1:
        balls = [
            rounded_box(
                (w * 0.28, d * 0.3, h * 0.3), (x * w * 0.3, y * d * 0.3, h * 0.6), 0.04
            ).translated(0, 0, sampler.uniform(0, 0.04))
            for x in (-1, 0, 1)
            for y in (-1, 0, 1)
        ]
        groups.append((sampler.pale(), balls))
    elif kind == 2:
        books = [
            box((w * 0.09, d * 0.7, h * sampler.uniform(0.7, 1.1)), (x * w, 0, 0.008))
            for x in (-0.36, -0.25, -0.14, -0.02, 0.1)
        ]
        groups += [(sampler.plastic(), books[::2]), (sampler.fabric(), books[1::2])]
    return assemble("box", *groups)


def shoe_box(sampler: Sampler) -> Model:
    """A low box with a loose overlapping lid, closed, askew or leaning beside it."""
    w, d, h = sampler.size(0.3, 0.38), sampler.size(0.18, 0.24), sampler.size(0.11, 0.17)
    rim = h * sampler.uniform(0.2, 0.4)
    base, lid = _card(sampler), _card(sampler)
    top = [box((w + 0.012, d + 0.012, 0.006), (0, 0, rim - 0.006))]
    top += [box((w + 0.012, 0.005, rim - 0.004), (0, s * (d / 2 + 0.0035), 0)) for s in (-1, 1)]
    top += [box((0.005, d + 0.002, rim - 0.004), (s * (w / 2 + 0.0035), 0, 0)) for s in (-1, 1)]
    groups: list[tuple[Material, list[Mesh]]] = [(base, _walls((w, d, h), 0.005))]
    if sampler.chance(0.6):
        groups.append((lid, [m.translated(0, 0, h - rim + 0.008) for m in top]))
    else:
        turn = sampler.uniform(8, 24)
        groups.append((lid, [m.rotated("z", turn).translated(0.02, 0.01, h - 0.0) for m in top]))
    if sampler.chance(0.6):
        label = box((w * 0.3, 0.003, h * 0.35), (w * 0.2, -d / 2 - 0.001, h * 0.12))
        groups.append((sampler.pale(), [label]))
    return assemble("box", *groups)


def crate(sampler: Sampler) -> Model:
    """A slatted wooden crate with corner posts and hand holes, empty or with bottles or fruit."""
    w, d, h = sampler.size(0.36, 0.56), sampler.size(0.26, 0.38), sampler.size(0.2, 0.34)
    rows, t = sampler.integer(2, 4), 0.012
    gap = h * sampler.uniform(0.04, 0.09)
    slat = (h - 0.01) / rows - gap
    wood = [
        box((w - 0.03, (d - 0.04) / 4 - 0.012, 0.01), (0, (k - 1.5) * (d - 0.04) / 4, 0.006))
        for k in range(4)
    ]
    for k in range(rows):
        z = 0.01 + k * (slat + gap)
        wood += [box((w, t, slat), (0, s * (d - t) / 2, z)) for s in (-1, 1)]
        wood += [box((t, d - 2 * t - 0.002, slat), (s * (w - t) / 2, 0, z)) for s in (-1, 1)]
    posts = [
        box((0.026, 0.026, h), (x * (w / 2 - t - 0.014), y * (d / 2 - t - 0.014), 0))
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    groups = [(sampler.wood(), wood), (sampler.wood(), posts)]
    if sampler.chance(0.3):
        angle = np.linspace(0, np.pi, 7)
        for s in (-1, 1):
            loop = [
                (s * (w / 2 + 0.012), 0.09 * np.cos(a), h * 0.75 - 0.07 * np.sin(a)) for a in angle
            ]
            groups.append((groups[1][0], [tube(loop, 0.009)]))
    if sampler.chance(0.35):
        r = min(w, d) * 0.1
        bottles = [
            cylinder(r, h * 1.05, (x * w * 0.28, y * d * 0.2, 0.017), 10)
            for x in (-1, 0, 1)
            for y in (-1, 1)
        ]
        groups.append((sampler.plastic(), bottles))
    return assemble("box", *groups)


def gift_box(sampler: Sampler) -> Model:
    """A wrapped present: a lid or plain paper, a crossed ribbon and a bow of loops."""
    w = sampler.size(0.2, 0.38)
    d, h = w * sampler.uniform(0.65, 1.0), w * sampler.uniform(0.35, 1.0)
    paper = sampler.fabric() if sampler.chance(0.7) else sampler.plastic()
    body, top = [box((w, d, h))], h
    groups = [(paper, body)]
    grow = 0.0
    if sampler.chance(0.5):
        grow, top = 0.012, h + 0.006
        lid = box((w + grow, d + grow, h * 0.22), (0, 0, top - h * 0.22))
        groups.append((paper if sampler.chance(0.5) else sampler.fabric(), [lid]))
    band = w * sampler.uniform(0.08, 0.16)
    ribbon = [
        box((band, d + grow + 0.006, top + 0.003)),
        box((w + grow + 0.006, band, top + 0.004), (0, 0, 0)),
    ]
    size = w * sampler.uniform(0.14, 0.24)
    for k in range(sampler.choice([2, 4, 6])):
        loop = torus(size, size * 0.22, segments=12).scaled(1.0, 0.55, 1.0).rotated("x", 90)
        loop = loop.rotated("y", -25).translated(size * 0.95, 0, top + size * 0.75)
        ribbon.append(loop.rotated("z", k * 180 if k < 2 else k * 60 + 30))
    ribbon.append(rounded_box((size * 0.7, size * 0.7, size * 0.6), (0, 0, top), size * 0.2))
    return assemble("box", *groups, (sampler.plastic(), ribbon))


def storage_box(sampler: Sampler) -> Model:
    """A tapered plastic storage box: ribs, a stepped lid, latches at its ends, at times wheels."""
    w, d, h = sampler.size(0.38, 0.6), sampler.size(0.28, 0.4), sampler.size(0.18, 0.34)
    lift = 0.03 if sampler.chance(0.3) else 0.0
    body = [_tapered((w, d, h), sampler.uniform(0.82, 0.94)).translated(0, 0, lift)]
    body.append(box((w + 0.014, d + 0.014, 0.014), (0, 0, lift + h - 0.03)))
    lid = [rounded_box((w + 0.03, d + 0.03, 0.03), (0, 0, lift + h - 0.006), 0.01)]
    lid.append(rounded_box((w * 0.8, d * 0.75, 0.026), (0, 0, lift + h + 0.01), 0.01))
    if sampler.chance(0.4):
        bow = [
            (-w * 0.14, 0, lift + h + 0.03),
            (-w * 0.1, 0, lift + h + 0.065),
            (w * 0.1, 0, lift + h + 0.065),
            (w * 0.14, 0, lift + h + 0.03),
        ]
        lid.append(tube(bow, 0.009))
    latches = [
        rounded_box((0.018, d * 0.3, 0.075), (s * (w / 2 + 0.018), 0, lift + h - 0.055), 0.007)
        for s in (-1, 1)
    ]
    dark: list[Mesh] = []
    if lift:
        dark = [
            cylinder(0.025, 0.02, segments=12)
            .rotated("x", 90)
            .translated(x * w * 0.36, y * d * 0.34 + 0.01, 0.025)
            for x in (-1, 1)
            for y in (-1, 1)
        ]
    skin = sampler.pale() if sampler.chance(0.4) else sampler.plastic()
    return assemble(
        "box",
        (skin, body),
        (sampler.plastic(), lid),
        (sampler.plastic(), latches),
        (sampler.dark(), dark),
    )


def _tapered(size: Size, low: float) -> Mesh:
    """A box whose foot is narrower by a factor."""
    mesh = box(size)
    shrink = np.where(mesh.vertices[:, 2:] < size[2] / 2, low, 1.0)
    return Mesh(
        np.concatenate([mesh.vertices[:, :2] * shrink, mesh.vertices[:, 2:]], axis=1),
        mesh.faces,
        mesh.uv,
    )


def moving_box(sampler: Sampler) -> Model:
    """A closed moving box: parted flaps, tape over the seam, dark hand holes, a written label."""
    w, d, h = sampler.size(0.38, 0.6), sampler.size(0.3, 0.42), sampler.size(0.28, 0.45)
    gap = sampler.uniform(0.004, 0.012)
    card = [box((w, d, h - 0.006))]
    card += [box((w, (d - gap) / 2, 0.006), (0, s * (d + gap) / 4, h - 0.006)) for s in (-1, 1)]
    tape = [box((w + 0.004, 0.05, 0.004), (0, 0, h - 0.001))]
    tape += [box((0.004, 0.05, h * 0.3), (s * (w / 2 + 0.001), 0, h * 0.7)) for s in (-1, 1)]
    holes = [box((0.004, 0.1, 0.03), (s * (w / 2 + 0.001), 0, h * 0.58)) for s in (-1, 1)]
    marks = [box((w * 0.35, 0.004, h * 0.2), (-w * 0.15, -d / 2 - 0.001, h * 0.55))]
    arrows = [box((0.02, 0.004, h * 0.2), (x * w, -d / 2 - 0.001, h * 0.15)) for x in (0.26, 0.34)]
    groups = [(_card(sampler), card), (sampler.pale(), tape), (sampler.dark(), [*holes, *arrows])]
    if sampler.chance(0.6):
        groups.append((sampler.fabric(), marks))
    return assemble("box", *groups)


def stacked_boxes(sampler: Sampler) -> Model:
    """Two or three closed boxes of different sizes, one on the other and slightly turned."""
    z, w, d = 0.0, sampler.size(0.4, 0.55), sampler.size(0.32, 0.42)
    groups: list[tuple[Material, list[Mesh]]] = []
    tape: list[Mesh] = []
    for _ in range(sampler.integer(2, 3)):
        h, turn = sampler.size(0.16, 0.3), sampler.uniform(-14, 14)
        seam = sampler.choice([0.04, 0.06])
        strips = [box((w + 0.004, seam, h * 0.25), (0, 0, h * 0.75 + 0.002))]
        tape += [m.rotated("z", turn).translated(0, 0, z) for m in strips]
        groups.append((_card(sampler), [box((w, d, h)).rotated("z", turn).translated(0, 0, z)]))
        z += h + 0.002
        w, d = w * sampler.uniform(0.65, 0.92), d * sampler.uniform(0.7, 0.95)
    return assemble("box", *groups, (sampler.pale(), tape))


def hat_box(sampler: Sampler) -> Model:
    """A round lidded box with a cord or a ribbon around it, at times a smaller one on top."""
    r, h = sampler.size(0.14, 0.2), sampler.size(0.12, 0.24)
    body, lids, cords = [], [], []
    z = 0.0
    for _ in range(sampler.integer(1, 2)):
        body.append(cylinder(r, h - 0.01, (0, 0, z), 20))
        lids.append(cylinder(r * 1.03, h * 0.25, (0, 0, z + h * 0.75), 20))
        z += h
        r, h = r * 0.78, h * 0.8
    bow = [(-0.06, 0, z - 0.004), (-0.05, 0, z + 0.07), (0.05, 0, z + 0.07), (0.06, 0, z - 0.004)]
    cords.append(tube(bow, 0.006))
    cords.append(rod((-r * 1.0, 0, z), (r * 1.0, 0, z), 0.005))
    return assemble(
        "box", (sampler.fabric(), body), (sampler.fabric(), lids), (sampler.plastic(), cords)
    )
