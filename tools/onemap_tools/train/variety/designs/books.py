"""Books: a closed one, stacks, an open one, one face down, a row between ends, magazines."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, from_faces, rod, rounded_box
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler

Size = tuple[float, float, float]


def _paper(sampler: Sampler) -> Material:
    return sampler.material("stripes", 0.02, (0.93, 0.9, 0.8))


def _cover(sampler: Sampler) -> Material:
    return sampler.choice([sampler.plastic, sampler.plastic, sampler.fabric, sampler.upholstery])()


def _closed(size: Size, board: float, overhang: float) -> tuple[list[Mesh], list[Mesh]]:
    """Covers and pages of a lying book; its spine runs along x at the front."""
    w, d, t = size
    covers = [box((w, d, board), (0, 0, z)) for z in (0.0, t - board)]
    spine = cylinder(t / 2, w, segments=12).rotated("y", 90).scaled(1.0, 0.45, 1.0)
    covers.append(spine.translated(-w / 2, -d / 2 + 0.001, t / 2))
    inside = (w - 2 * overhang, d - overhang, t - 2 * board)
    return covers, [box(inside, (0, -overhang / 2, board))]


def _sheet(profile: list[tuple[float, float]], depth: float, thick: float | list[float]) -> Mesh:
    """A sheet bent along (x, z) points of rising x, ``depth`` along y, ``thick`` upwards."""
    line = np.asarray(profile)
    count = len(line)
    rows = []
    for y in (-depth / 2, depth / 2):
        for dz in (np.zeros(count), np.full(count, thick)):
            rows.append(np.stack([line[:, 0], np.full(count, y), line[:, 1] + dz], axis=1))
    low, high, low_back, high_back = (np.arange(count) + k * count for k in range(4))
    quads = []
    for i in range(count - 1):
        j = i + 1
        quads += [(high[i], high[j], high_back[j], high_back[i])]
        quads += [(low[i], low_back[i], low_back[j], low[j])]
        quads += [(low[i], low[j], high[j], high[i])]
        quads += [(low_back[i], high_back[i], high_back[j], low_back[j])]
    for i, flip in ((0, False), (count - 1, True)):
        quad = (low[i], high[i], high_back[i], low_back[i])
        quads.append(quad[::-1] if flip else quad)
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    return from_faces(np.concatenate(rows), faces)


def closed_book(sampler: Sampler) -> Model:
    """One thick book that lies closed: boards over the pages, raised bands, a title, a ribbon."""
    w, d, t = sampler.size(0.2, 0.32), sampler.size(0.15, 0.24), sampler.size(0.025, 0.07)
    covers, pages = _closed((w, d, t), 0.005, sampler.uniform(0.003, 0.008))
    bands = []
    if sampler.chance(0.5):
        for x in np.linspace(-0.36, 0.36, sampler.integer(3, 5)):
            band = cylinder(t / 2 + 0.003, 0.01, segments=12).rotated("y", 90).scaled(1.0, 0.5, 1.0)
            bands.append(band.translated(x * w, -d / 2, t / 2))
    wide, deep = sampler.choice([(0.5, 0.22), (0.86, 0.7), (0.3, 0.5)])
    title = [box((w * wide, d * deep, 0.002), (0, d * 0.06, t))]
    ribbon = [box((0.008, d * 0.4, 0.002), (w * 0.1, d * 0.6, t * 0.5))]
    turn = sampler.uniform(-30, 30)
    groups = [(_cover(sampler), covers), (_paper(sampler), pages), (sampler.plastic(), title)]
    if bands:
        groups.append((sampler.metal(), bands))
    if sampler.chance(0.5):
        groups.append((sampler.plastic(), ribbon))
    low = -0.003 if bands else 0.0
    return assemble(
        "book",
        *(
            (m, [p.translated(0, 0, -low).rotated("z", turn) for p in meshes])
            for m, meshes in groups
        ),
    )


def book_stack(sampler: Sampler) -> Model:
    """A stack of books of many formats, spines to different sides, the top one at an angle."""
    z = 0.0
    pages: list[Mesh] = []
    groups: list[tuple[Material, list[Mesh]]] = []
    size = sampler.uniform(0.85, 1.2)
    for _ in range(sampler.integer(3, 7)):
        w, d, t = (
            sampler.uniform(0.18, 0.28),
            sampler.uniform(0.13, 0.2),
            sampler.uniform(0.014, 0.05),
        )
        covers, block = _closed((w * size, d * size, t), 0.004, 0.005)
        turn = sampler.choice([0.0, 180.0, 0.0, 90.0]) + sampler.uniform(-12, 12)
        groups.append((_cover(sampler), [m.rotated("z", turn).translated(0, 0, z) for m in covers]))
        pages += [m.rotated("z", turn).translated(0, 0, z) for m in block]
        z += t + 0.001
    return assemble("book", (_paper(sampler), pages), *groups)


def open_book(sampler: Sampler) -> Model:
    """A book lying open: two curved blocks of pages on flat covers, text, a turning leaf."""
    w, d, t = sampler.size(0.15, 0.22), sampler.size(0.2, 0.3), sampler.size(0.018, 0.04)
    share = sampler.uniform(0.3, 0.7)
    covers = [box((2 * w + 0.02, d + 0.012, 0.004))]
    pages, text = [], []
    x = np.array([0.0, 0.06, 0.18, 0.4, 0.7, 1.0])
    rise = np.array([0.25, 0.75, 1.0, 0.97, 0.85, 0.72])
    for side, high in ((-1, t * 2 * share), (1, t * 2 * (1 - share))):
        for layer in (1.0, 0.66, 0.33):
            wide = w * (1 - 0.02 * (1 - layer))
            line = [(side * float(a) * wide, 0.004) for a in x]
            tops = [0.002 + high * layer * float(r) for r in rise]
            pages.append(_sheet(line[::side], d, tops[::side]))
        for y in np.linspace(-0.36, 0.36, sampler.integer(5, 8)):
            line = [
                (side * float(a) * w, 0.0065 + high * float(r))
                for a, r in zip(x[2:], rise[2:], strict=True)
            ]
            line = [(px * 0.9 + side * 0.02, pz) for px, pz in line]
            text.append(_sheet(line[::side], d * 0.03, 0.001).translated(0, float(y) * d, 0))
    groups = [(_cover(sampler), covers), (_paper(sampler), pages), (sampler.dark(), text)]
    if sampler.chance(0.4):
        leaf = [(0.0, t), (0.02, t + w * 0.4), (w * 0.1, t + w * 0.7), (w * 0.3, t + w * 0.85)]
        groups.append((sampler.pale(), [_sheet(leaf, d * 0.98, 0.0015)]))
    turn = sampler.uniform(-20, 20)
    return assemble("book", *((m, [p.rotated("z", turn) for p in meshes]) for m, meshes in groups))


def face_down_book(sampler: Sampler) -> Model:
    """A book laid face down half read: its covers a low roof, pages fanned beneath."""
    w, d = sampler.size(0.13, 0.18), sampler.size(0.2, 0.27)
    slope, t = sampler.uniform(14, 32), sampler.uniform(0.008, 0.018)
    covers, pages = [], []
    for side in (-1, 1):
        half = box((w, d, 0.004), (side * w / 2, 0, 0))
        rise = w * float(np.sin(np.radians(slope)))
        covers.append(half.rotated("y", side * slope).translated(0, 0, rise + t))
        block = box((w - 0.008, d - 0.012, t), (side * (w - 0.008) / 2, 0, -t))
        pages.append(block.rotated("y", side * slope * 0.97).translated(0, 0, rise + t))
    ridge = w * float(np.sin(np.radians(slope))) + t
    covers.append(rounded_box((t * 1.6, d, 0.01), (0, 0, ridge - 0.003), 0.004))
    title = box((w * 0.6, d * 0.3, 0.002), (w * 0.5, d * 0.15, 0.004))
    title = title.rotated("y", slope).translated(0, 0, ridge)
    low = min(float(m.vertices[:, 2].min()) for m in (*covers, *pages))
    turn = sampler.uniform(-40, 40)
    groups = [(_cover(sampler), covers), (_paper(sampler), pages), (sampler.plastic(), [title])]
    return assemble(
        "book",
        *(
            (m, [p.translated(0, 0, -low).rotated("z", turn) for p in meshes])
            for m, meshes in groups
        ),
    )


def book_row(sampler: Sampler) -> Model:
    """Books upright between two ends: plates, blocks or balls; the last one leaning at times."""
    books, pages, groups = [], [], list[tuple[Material, list[Mesh]]]()
    x, height = 0.0, sampler.uniform(0.9, 1.1)
    for _ in range(sampler.integer(4, 9)):
        t, h = sampler.uniform(0.018, 0.05), sampler.uniform(0.17, 0.27) * height
        d = h * sampler.uniform(0.62, 0.78)
        covers, block = _closed((h, d, t), 0.003, 0.004)
        upright = [m.rotated("y", -90).translated(x + t, 0, h / 2) for m in (*covers, *block)]
        books.append(upright[:-1])
        pages.append(upright[-1])
        x += t + 0.002
    kind, ends, tall = sampler.integer(0, 2), [], 0.15 * height
    for side, at in ((-1, -0.003), (1, x + 0.003)):
        if kind == 0:
            ends += [
                box((0.006, 0.11, tall), (at + side * 0.003, 0, 0)),
                box((0.09, 0.11, 0.005), (at + side * 0.05, 0, 0)),
            ]
        elif kind == 1:
            ends.append(rounded_box((0.06, 0.12, tall), (at + side * 0.031, 0, 0), 0.012))
        else:
            ends += [
                box((0.07, 0.1, 0.02), (at + side * 0.036, 0, 0)),
                rod((at + side * 0.03, 0, 0.01), (at + side * 0.03, 0, tall), 0.018),
                rounded_box((0.055, 0.055, 0.055), (at + side * 0.031, 0, tall - 0.01), 0.026),
            ]
    groups.append((_paper(sampler), pages))
    groups.append((sampler.metal() if sampler.chance(0.5) else sampler.wood(), ends))
    groups += [(_cover(sampler), covers) for covers in books]
    return assemble("book", *((m, [p.translated(-x / 2, 0, 0) for p in ms]) for m, ms in groups))


def magazine_pile(sampler: Sampler) -> Model:
    """A sliding pile of thin soft magazines, the upper ones turned, one curled or rolled on top."""
    groups: list[tuple[Material, list[Mesh]]] = []
    pages, z = [], 0.0
    w, d = sampler.size(0.21, 0.25), sampler.size(0.27, 0.32)
    for _ in range(sampler.integer(5, 11)):
        t = sampler.uniform(0.004, 0.011)
        turn, dx, dy = (
            sampler.uniform(-16, 16),
            sampler.uniform(-0.02, 0.02),
            sampler.uniform(-0.02, 0.02),
        )
        cover = box((w, d, 0.0015), (0, 0, t - 0.0015)).rotated("z", turn).translated(dx, dy, z)
        pages.append(box((w, d, t - 0.002)).rotated("z", turn).translated(dx, dy, z))
        groups.append((sampler.fabric() if sampler.chance(0.5) else sampler.plastic(), [cover]))
        z += t + 0.001
    if sampler.chance(0.5):
        line = [
            (-w / 2, z + 0.03),
            (-w / 4, z + 0.008),
            (0.0, z),
            (w / 4, z + 0.008),
            (w / 2, z + 0.035),
        ]
        groups.append((sampler.fabric(), [_sheet(line, d, 0.004).rotated("z", 20)]))
    elif sampler.chance(0.5):
        roll = cylinder(0.024, d, (0, 0, -d / 2), 12).rotated("y", 90).rotated("z", 55)
        groups.append((sampler.fabric(), [roll.translated(0, 0, z + 0.024)]))
    return assemble("book", (sampler.pale(), pages), *groups)


def standing_open_book(sampler: Sampler) -> Model:
    """A hardback or greeting-sized album that stands upright, opened like a fan."""
    w, h = sampler.size(0.14, 0.2), sampler.size(0.2, 0.3)
    spread = sampler.uniform(25, 55)
    covers, pages = [], []
    for side in (-1, 1):
        board = box((w, 0.005, h), (side * w / 2, 0, 0)).rotated("z", -side * spread)
        covers.append(board)
        for k in (0.72, 0.45, 0.2):
            leaf = box((w - 0.01, 0.004, h - 0.012), (side * (w - 0.008) / 2, 0, 0.006))
            pages.append(leaf.rotated("z", -side * (spread + (88 - spread) * (1 - k))))
    covers.append(box((0.02, 0.012, h), (0, 0.002, 0)))
    back = w * float(np.sin(np.radians(spread))) / 2
    groups = [(_cover(sampler), covers), (_paper(sampler), pages)]
    return assemble("book", *((m, [p.translated(0, back, 0) for p in ms]) for m, ms in groups))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "book": (
        closed_book,
        book_stack,
        open_book,
        face_down_book,
        book_row,
        magazine_pile,
        standing_open_book,
    ),
}
