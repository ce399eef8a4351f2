"""Parts that several classes share: legs, feet, fronts, handles, rows of books."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from onemap_tools.foreign.finish import Finish, FinishedPart, finished, pictured
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.images import book_spines
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    curve,
    joined,
    loft,
    revolved,
    ring,
    smooth_profile,
    tube,
)

Parts = list[FinishedPart]
SPINES = 24  # on one strip of pictures of books


def corners(width: float, depth: float, inset: float) -> Iterator[tuple[float, float]]:
    """The four corners of a rectangle about the origin, moved inwards."""
    for x in (inset - width / 2, width / 2 - inset):
        for y in (inset - depth / 2, depth / 2 - inset):
            yield x, y


def legs(width: float, depth: float, height: float, kind: int, inset: float = 0.05) -> PlainMesh:
    """Four legs. kind 0: square; 1: round and splayed; 2: turned; 3: hairpins; 4: curved."""
    made = []
    for x, y in corners(width, depth, inset):
        sx, sy = float(np.sign(x)), float(np.sign(y))
        if kind == 0:
            made.append(block(0.05, 0.05, height).at(x, y))
        elif kind == 1:
            path = [(x + 0.05 * sx, y + 0.05 * sy, 0), (x, y, height)]
            made.append(tube(path, [0.012, 0.022]))
        elif kind == 2:
            turned = ((0.016, 0), (0.026, 0.06), (0.016, 0.12), (0.032, 0.5), (0.016, 0.74),
                      (0.03, 0.8), (0.03, 1.0))  # fmt: skip
            profile = smooth_profile([(r, share * height) for r, share in turned])
            made.append(revolved(profile, 14).at(x, y))
        elif kind == 3:
            for side in (-1, 1):
                path = [(x, y, 0.006), (x + 0.05 * side, y - 0.03 * sy, height)]
                made.append(tube(path, 0.006, 6))
        else:
            steps = ((0.03, 0.0), (-0.005, 0.35), (0.025, 0.8), (0.0, 1.0))
            bow = curve([(x + out * sx, y + out * sy, share * height) for out, share in steps])
            made.append(tube(bow, np.linspace(0.012, 0.028, len(bow))))
    return joined(made)


def frame(width: float, height: float, thick: float, deep: float) -> PlainMesh:
    """A rectangular frame standing in the plane y = 0, its outer lower edge at z = 0."""
    profile = [
        (0.0, 0.0),
        (0.0, -deep),
        (thick * 0.4, -deep * 1.2),
        (thick, -deep * 0.5),
        (thick, 0.0),
    ]
    rings = []
    for inset, y in profile:
        w, low, high = width / 2 - inset, inset, height - inset
        rings.append(np.array([[-w, y, low], [w, y, low], [w, y, high], [-w, y, high]]))
    return loft(rings, caps=False)


def handle(kind: int, length: float = 0.12) -> PlainMesh:
    """A handle that looks along -y, its middle at the origin. 0: bow; 1: knob; 2: bar; 3: shell."""
    half = length / 2
    if kind == 0:
        bow = [(-half, 0, 0), (-half, -0.025, 0), (half, -0.025, 0), (half, 0, 0)]
        return tube(curve([bow[0], bow[1], (0, -0.032, 0), bow[2], bow[3]], 4), 0.005, 8)
    if kind == 1:
        profile = smooth_profile(
            [(0.006, 0), (0.007, 0.012), (0.017, 0.02), (0.013, 0.03), (0, 0.032)], 3
        )
        return revolved(profile, 14).turned(pitch=np.pi / 2)
    if kind == 2:
        posts = [tube([(x, 0, 0), (x, -0.03, 0)], 0.004, 6) for x in (-0.4 * length, 0.4 * length)]
        return joined([tube([(-half, -0.03, 0), (half, -0.03, 0)], 0.006, 8), *posts])
    return (
        revolved([(0, 0), (0.035, 0.0), (0.03, 0.012), (0, 0.02)], 16)
        .turned(pitch=np.pi / 2)
        .scaled(z=0.6)
    )


def front(width: float, height: float, kind: int) -> PlainMesh:
    """A door or drawer front that looks along -y, lower edge at z = 0, back at y = 0.

    kind 0: flat with round edges; 1: frame and sunk panel; 2: raised panel; 3: grooves; 4: slats.
    """
    board = block(width, 0.018, height, 0.004).at(y=-0.009)
    if kind == 1:
        return joined(
            [
                block(width, 0.008, height, 0.002).at(y=-0.004),
                frame(width, height, min(0.06, 0.2 * height, 0.2 * width), 0.02),
            ]
        )
    if kind == 2:
        rings = [np.array([[-w, y, z], [w, y, z], [w, y, height - z], [-w, y, height - z]])
                 for w, y, z in ((width / 2 - 0.05, -0.018, 0.05), (width / 2 - 0.08, -0.03, 0.08))
                 if height > 0.2 and width > 0.2]  # fmt: skip
        return joined([board, loft(rings)]) if rings else board
    if kind == 3:
        count = max(int(width / 0.08), 2)
        step = width / count
        return joined(
            [
                block(step - 0.006, 0.018, height, 0.004).at((i + 0.5) * step - width / 2, -0.009)
                for i in range(count)
            ]
        )
    if kind == 4:
        count = max(int(height / 0.045), 3)
        step = height / count
        slats = [
            block(width - 0.06, 0.012, step * 0.9, 0.003).turned(pitch=0.5).at(0, -0.01, i * step)
            for i in range(count)
        ]
        return joined([*slats, frame(width, height, 0.035, 0.02)])
    return board


def books(look: FinishPicker, width: float, height: float, depth: float) -> Parts:
    """A row of books from x = 0 on, spines along -y at y = 0, with a gap and a leaning one."""
    strip = look.shown(book_spines(look.rng, SPINES), gloss=0.08)
    meshes, uvs, x = [], [], 0.0
    end = width * look.between(0.6, 1.0)
    while True:
        thick, tall = look.between(0.015, 0.05), height * look.between(0.6, 0.93)
        if x + thick > end:
            break
        deep = depth * look.between(0.65, 0.9)
        lean = look.between(0.0, 0.25) if x + 2.5 * thick > end and end < 0.95 * width else 0.0
        book = block(thick, deep, tall, 0.0015, 1)
        uvs.append(_spine_uv(book, int(look.rng.integers(SPINES)), thick, tall))
        meshes.append(book.turned(roll=-lean).at(x + thick / 2, deep / 2))
        x += thick + tall * np.sin(lean) * 0.5
    if not meshes:
        return []
    return [FinishedPart(joined(meshes), np.concatenate(uvs), strip)]


def _spine_uv(book: PlainMesh, number: int, thick: float, tall: float) -> np.ndarray:
    """The spine's picture on its front; the other sides show the colour of its edge."""
    points = book.vertices[book.faces]
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    is_front = (np.abs(normal[:, 1]) > np.abs(normal).max(axis=1) * 0.9) & (
        points[..., 1].mean(axis=1) < 0
    )
    across = np.where(is_front[:, None], points[..., 0] / thick + 0.5, 0.12)
    return np.stack(
        [
            (number + 0.05 + 0.9 * np.clip(across, 0, 1)) / SPINES,
            1 - points[..., 2] / tall * 0.98 - 0.01,
        ],
        axis=-1,
    )


def vessel(profile: list[tuple[float, float]], points: int = 24) -> PlainMesh:
    """A thing of revolution through a smooth profile."""
    return revolved(smooth_profile(profile, 5), points)


def jumble(look: FinishPicker, width: float, height: float, depth: float) -> Parts:
    """What lies on a shelf from x = 0 on: books, boxes, jars, baskets, a picture."""
    parts: Parts = []
    x = look.between(0.0, 0.06)
    while x < width - 0.12:
        kind, size = int(look.rng.integers(6)), look.between(0.1, 0.2)
        tall = min(size, 0.9 * height)
        if kind == 0:
            size = min(look.between(0.15, 0.35), width - x)
            parts += moved(books(look, size, height, depth), x, 0.02)
        elif kind == 5:
            image = look.shown(book_spines(look.rng, 6))
            parts += moved([pictured(0.7 * tall, tall, image)], x + size / 2, depth / 3)
        else:
            parts += moved([_shelf_thing(look, kind, size, tall, depth)], x + size / 2, depth / 2)
        x += size + look.between(0.02, 0.1)
    return parts


def _shelf_thing(
    look: FinishPicker, kind: int, size: float, tall: float, depth: float
) -> FinishedPart:
    """1: a box; 2: a jar; 3: a basket; 4: three things that lie on each other."""
    if kind == 1:
        box = block(size, min(size, 0.8 * depth), 0.8 * tall, 0.004)
        return finished(box, look.plastic(look.one_of(look.palette.textiles)))
    if kind == 2:
        steps = ((0.3, 0), (0.36, 0.4), (0.2, 0.8), (0.24, 1.0), (0.0, 1.0))
        return finished(vessel([(r * tall, z * tall) for r, z in steps]), look.lacquer())
    if kind == 3:
        sides = ((0.8, 0), (1.0, 0.7 * tall), (0.9, 0.7 * tall), (0.75, 0.1))
        return finished(loft([ring(size * s, size * s, z, 5) for s, z in sides]), look.wicker())
    flat = block(size, 0.7 * depth, 0.03, 0.002)
    lying = [flat.turned(yaw=look.between(-0.2, 0.2)).at(z=0.031 * i) for i in range(3)]
    return finished(joined(lying), look.cloth())


def moved(parts: Parts, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Parts:
    """All parts moved by metres."""
    return [FinishedPart(part.mesh.at(x, y, z), part.uv, part.finish) for part in parts]


def rotated(parts: Parts, yaw: float = 0.0, pitch: float = 0.0) -> Parts:
    """All parts rotated by radians about the origin: about x, then about z."""
    return [FinishedPart(p.mesh.turned(yaw, pitch), p.uv, p.finish) for p in parts]


def plinth(width: float, depth: float, finish: Finish, height: float = 0.08) -> FinishedPart:
    """A base that stands back from the front."""
    return finished(block(width - 0.02, depth - 0.06, height, 0.002).at(y=0.02), finish)


def drawer_block(width: float, depth: float, height: float, count: int, kind: int) -> PlainMesh:
    """A block of drawers."""
    step = (height - 0.06) / count
    fronts = [
        front(width - 0.02, step - 0.012, kind).at(0, -depth / 2, 0.04 + i * step)
        for i in range(count)
    ]
    return joined([block(width, depth, height, 0.003), *fronts])


def splayed(spread: float, height: float, count: int) -> PlainMesh:
    """Round legs that lean outwards from under a seat."""
    rods = []
    for a in np.arange(count) * 2 * np.pi / count + 0.5:
        c, s = np.cos(a), np.sin(a)
        rods.append(
            tube(
                [
                    (0.7 * spread * c, 0.7 * spread * s, 0),
                    (0.4 * spread * c, 0.4 * spread * s, height),
                ],
                0.014,
            )
        )
    return joined(rods)
