"""Pictures, clocks, mirrors, curtains, rugs, plants, vases, and things to play with.

What hangs on a wall has z = 0 at its lower edge.
"""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import U8
from onemap_simulator.generation.mesh import (
    Material,
    Mesh,
    Model,
    assemble,
    box,
    box_between,
    cylinder,
    ellipsoid,
    from_faces,
    front_panel,
    knob,
    lathe,
    panel,
    prism,
    rod,
    torus,
    tube,
)
from onemap_simulator.generation.style import Sampler
from onemap_simulator.generation.textures import smooth_noise, to_image


def _frame(width: float, height: float, bar: float, depth: float) -> list[Mesh]:
    """Four bars around a rectangle, in front of the wall at y = 0."""
    x, y = width / 2 - bar / 2, -depth / 2
    return [
        *(box((width, depth, bar), (0, y, z)) for z in (0, height - bar)),
        *(box((bar, depth, height), (s * x, y, 0)) for s in (-1, 1)),
    ]


def picture(draw: Sampler) -> Model:
    """A framed abstract painting, upright, square or wide."""
    width, height = draw.sizes((0.45, 0.9), (0.45, 0.75))
    bar, depth = draw.sizes((0.025, 0.06), (0.025, 0.04))
    canvas = front_panel(width - bar, height - bar, (0, -0.015, bar / 2))
    art = Material(_painting(draw.rng))
    back = box((width - 0.01, 0.01, height - 0.01), (0, -0.005, 0.005))
    edge = draw.wood() if draw.chance(0.7) else draw.metal()
    return assemble("picture", (edge, [*_frame(width, height, bar, depth), back]), (art, [canvas]))


def _painting(rng: np.random.Generator) -> U8:
    """An abstract image (96, 96, 3): fields of colour, then discs, bars, strokes or hills."""
    image = np.empty((96, 96, 3), np.float32)
    image[:] = rng.uniform(0.3, 1.0, 3)
    kind = int(rng.integers(4))
    for _ in range(int(rng.integers(4, 9))):
        colour = tuple(map(float, rng.random(3)))
        a, b = (tuple(map(int, rng.integers(0, 96, 2))) for _ in range(2))
        if kind == 0:
            cv2.circle(image, a, int(rng.integers(6, 26)), colour, -1, cv2.LINE_AA)
        elif kind == 1:
            cv2.rectangle(image, a, b, colour, -1)
        elif kind == 2:
            cv2.line(image, a, b, colour, int(rng.integers(3, 12)), cv2.LINE_AA)
        else:
            crest = int(rng.integers(25, 85)) + 18 * (smooth_noise(rng, (1, 4), 64)[0] - 0.5)
            ridge = np.interp(np.arange(96), np.linspace(0, 95, 64), crest)
            image[np.arange(96)[:, None] > ridge] = colour
    image += 0.08 * (smooth_noise(rng, (32, 32), 96)[..., None] - 0.5)
    if rng.random() < 0.4:  # a paper mount around the picture
        small = cv2.resize(image, (68, 68))
        image[:] = 0.94
        image[14:-14, 14:-14] = small
    return to_image(image)


def clock(draw: Sampler) -> Model:
    """A wall clock: a rim, a pale or dark face with twelve marks and two hands."""
    radius, depth = draw.size(0.15, 0.21), 0.05
    edge = draw.metal() if draw.chance(0.5) else draw.wood()
    if draw.chance(0.75):
        plate, ink = draw.pale(), draw.dark()
    else:
        plate, ink = draw.dark(), draw.pale()
    marks = []
    for hour in range(12):
        long = 0.2 if hour % 3 == 0 else 0.12
        mark = box((radius * 0.06, 0.006, radius * long), (0, 0, radius * (0.9 - long)))
        marks.append(mark.rotated("y", hour * 30).translated(0, -depth * 0.72, radius))
    for length, thick in ((0.5, 0.09), (0.75, 0.06)):
        hand = box((radius * thick, 0.006, radius * length), (0, 0, -0.02))
        hand = hand.rotated("y", draw.uniform(0, 360))
        marks.append(hand.translated(0, -depth * 0.78, radius))
    if draw.chance(0.3):  # a square case
        side = 2 * radius
        rim = _frame(side, side, radius * 0.1, depth)
        face = box((side - 0.01, depth * 0.7, side - 0.01), (0, -depth * 0.35, 0.005))
    else:
        hoop = [(radius, 0), (radius, depth), (radius * 0.92, depth), (radius * 0.9, depth * 0.6)]
        rim = [lathe(hoop, segments=28, capped=False).rotated("x", 90).translated(0, 0, radius)]
        face = knob(radius * 0.95, depth * 0.7, (0, 0, radius), 28)
    marks.append(knob(radius * 0.07, 0.01, (0, -depth * 0.78, radius), 8))
    return assemble("clock", (edge, rim), (plate, [face]), (ink, marks))


def mirror(draw: Sampler) -> Model:
    """A framed mirror, rectangular or oval; its glass is painted with a soft reflection."""
    width, height = draw.sizes((0.45, 0.65), (0.6, 0.95))
    glass = Material(_silver(draw.rng))
    edge = draw.metal() if draw.chance(0.5) else draw.wood()
    if draw.chance(0.35):
        ring = [(0.5, 0), (0.55, 0.01), (0.55, 0.035), (0.49, 0.035)]
        flat = cylinder(0.5, 0.02, segments=28), lathe(ring, segments=28, capped=False)
        plate, hoop = (
            mesh.rotated("x", 90).scaled(width, 1.0, height).translated(0, 0, height * 0.55)
            for mesh in flat
        )
        # One image across the whole oval: uv from x and z instead of metres.
        uv = plate.vertices[plate.faces][..., [0, 2]] / (width, -height) + (0.5, 1.05)
        plate = Mesh(plate.vertices, plate.faces, uv)
        return assemble("mirror", (edge, [hoop]), (glass, [plate]))
    bar = draw.size(0.02, 0.05)
    plate = front_panel(width - bar, height - bar, (0, -0.018, bar / 2))
    parts = _frame(width, height, bar, 0.035)
    parts.append(box((width - 0.01, 0.012, height - 0.01), (0, -0.006, 0.005)))
    if draw.chance(0.3):
        parts.append(rod((-width / 2, -0.05, -0.02), (width / 2, -0.05, -0.02), 0.015))
    return assemble("mirror", (edge, parts), (glass, [plate]))


def _silver(rng: np.random.Generator) -> U8:
    """A bluish grey gradient (64, 64, 3) with slanted bright streaks."""
    rows, columns = np.mgrid[0:64, 0:64] / 64.0
    base = 0.62 + 0.18 * rows + 0.06 * (smooth_noise(rng, (2, 2)) - 0.5)
    for at in rng.uniform(0.4, 1.6, 2):
        base = base + 0.2 * np.exp(-(((rows + columns - at) / 0.05) ** 2))
    return to_image(base[..., None] * np.array([0.92, 1.0, 1.06]))


def curtain(draw: Sampler, width: float, height: float) -> Model:
    """A pleated curtain that hangs from a rod; z = 0 is its hem."""
    pleats, depth, end = draw.integer(4, 8), draw.size(0.04, 0.07), width / 2 + 0.08
    x = np.linspace(-width / 2, width / 2, pleats * 4 + 1)
    y = depth * np.sin(np.linspace(0, 2 * np.pi * pleats, pleats * 4 + 1))
    cloth = []
    for i in range(len(x) - 1):
        along = (x[i + 1] - x[i], y[i + 1] - y[i], 0.0)
        strip = panel((x[i], y[i], height), along, (0.0, 0.0, -height))
        # Each strip shows its own part of the cloth, so that patterns run on.
        uv = strip.uv * (x[1] - x[0], height) + (x[i], 0.0)
        cloth.append(Mesh(strip.vertices, strip.faces, uv))
    bar = rod((-end, 0.0, height + 0.03), (end, 0.0, height + 0.03), 0.018)
    return assemble("curtain", (draw.fabric(), cloth), (draw.metal(), [bar]))


def rug(draw: Sampler, width: float, depth: float) -> Model:
    """A flat rug, rectangular with a border or round."""
    cloth, border = draw.fabric(), draw.fabric()
    if draw.chance(0.25):
        radius = min(width, depth) / 2
        outer = cylinder(radius, 0.01, segments=24)
        inner = cylinder(radius * 0.85, 0.014, segments=24)
    else:
        edge = draw.size(0.06, 0.15)
        outer = box((width, depth, 0.01))
        inner = box((width - 2 * edge, depth - 2 * edge, 0.014))
    return assemble("rug", (border, [outer]), (cloth, [inner]))


def floor_plant(draw: Sampler) -> Model:
    """A large potted plant for the floor."""
    return _potted(draw, *draw.sizes((0.15, 0.2), (0.8, 1.3)))


def small_plant(draw: Sampler) -> Model:
    """A potted plant for a table or sill."""
    return _potted(draw, *draw.sizes((0.08, 0.11), (0.32, 0.48)))


def _potted(draw: Sampler, radius: float, height: float) -> Model:
    """A pot with sword leaves, broad leaves on stems, or a bush."""
    pot_h = radius * draw.size(1.4, 1.9)
    outside = [(0.7, 0), (0.95, pot_h * 0.85), (1.05, pot_h * 0.86), (1.05, pot_h)]
    inside = [(0.9, pot_h), (0.88, pot_h * 0.9), (0.0, pot_h * 0.9)]
    pot = lathe([(radius * r, z) for r, z in outside + inside])
    grow = (_sword_leaves, _broad_leaves, _bush)[draw.integer(0, 2)]
    green, stems = grow(draw, radius, pot_h, height)
    bark = draw.material("noise", 0.2, (0.35, 0.24, 0.15))
    ceramic = draw.ceramic() if draw.chance(0.5) else draw.plastic()
    return assemble("potted plant", (ceramic, [pot]), (draw.foliage(), green), (bark, stems))


Foliage = tuple[list[Mesh], list[Mesh]]  # leaves, stems


def _sword_leaves(draw: Sampler, radius: float, pot_h: float, height: float) -> Foliage:
    tall, leaves = height - pot_h, []
    for _ in range(draw.integer(9, 14)):
        lean, turn = draw.uniform(8, 42), draw.uniform(0, 360)
        blade = _leaf(radius * draw.uniform(0.35, 0.6), tall * draw.uniform(0.7, 1.05), 0.25)
        blade = blade.rotated("x", -lean).rotated("z", turn)
        leaves.append(blade.translated(0, 0, pot_h * 0.9))
    return leaves, []


def _broad_leaves(draw: Sampler, radius: float, pot_h: float, height: float) -> Foliage:
    leaves, stems = [], []
    for _ in range(draw.integer(7, 11)):
        turn, reach = draw.uniform(0, 2 * np.pi), radius * draw.uniform(0.6, 1.6)
        x, y, z = reach * np.cos(turn), reach * np.sin(turn), height * draw.uniform(0.6, 0.92)
        stems.append(tube([(0, 0, pot_h * 0.8), (x * 0.3, y * 0.3, z * 0.8), (x, y, z)], 0.008, 5))
        blade = _leaf(radius * draw.uniform(0.9, 1.3), radius * draw.uniform(1.3, 2.0), 0.5)
        blade = blade.rotated("x", -draw.uniform(50, 110))
        leaves.append(blade.rotated("z", np.degrees(turn) + 90).translated(x, y, z))
    return leaves, stems


def _bush(draw: Sampler, radius: float, pot_h: float, height: float) -> Foliage:
    tall = height - pot_h
    middle = pot_h + tall * 0.55
    trunk = rod((0, 0, pot_h * 0.8), (0, 0, pot_h + tall * 0.5), 0.08 * radius + 0.006)
    leaves = []
    for _ in range(draw.integer(30, 45)):
        direction = draw.rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        at = (0, 0, middle) + direction * (radius * 1.25, radius * 1.25, tall * 0.38)
        blade = _leaf(radius * 0.55, radius * 0.9, 0.5).rotated("x", draw.uniform(-120, 30))
        leaves.append(blade.rotated("z", draw.uniform(0, 360)).translated(*at))
    leaves.append(ellipsoid((radius * 0.9, radius * 0.9, tall * 0.3), (0, 0, middle), 10))
    return leaves, [trunk]


def _leaf(width: float, length: float, widest: float) -> Mesh:
    """A pointed leaf that stands upright on the origin, folded along its midrib."""
    half, z = width / 2, length * widest
    points = [(0, 0, 0), (-half, -half * 0.4, z), (half, -half * 0.4, z), (0, 0, z), (0, 0, length)]
    return from_faces(points, [(0, 3, 1), (0, 2, 3), (1, 3, 4), (3, 2, 4)])


def vase(draw: Sampler) -> Model:
    """A vase of a random profile, often with flowers."""
    height, radius = draw.sizes((0.24, 0.36), (0.075, 0.12))
    belly, neck = draw.uniform(0.25, 0.65), draw.uniform(0.3, 0.65)
    profile = [
        (radius * 0.55, 0.0),
        (radius * 0.9, height * belly * 0.5),
        (radius, height * belly),
        (radius * neck, height * 0.85),
        (radius * neck * draw.uniform(1.1, 1.6), height),
        (radius * neck * 0.9, height * 0.97),
        (0.0, height * 0.8),
    ]
    if draw.chance(0.3):
        glaze = draw.ceramic()
    else:
        glaze = draw.fabric() if draw.chance(0.4) else draw.plastic()
    groups = [(glaze, [lathe(profile, segments=18)])]
    if draw.chance(0.6):
        stems, petals = [], []
        for _ in range(draw.integer(4, 8)):
            turn, spread = draw.uniform(0, 2 * np.pi), radius * draw.uniform(0.3, 1.6)
            z = height * draw.uniform(1.3, 1.75)
            tip = (spread * np.cos(turn), spread * np.sin(turn), z)
            stems.append(rod((0, 0, height * 0.8), tip, 0.006, 5))
            petals.append(ellipsoid((0.038, 0.038, 0.026), tip, 8))
        groups += [(draw.foliage(), stems), (draw.plastic(), petals)]
    return assemble("vase", *groups)


def bicycle(draw: Sampler) -> Model:
    """Two spoked wheels, a diamond or step-through frame, saddle, handlebar and pedals; along x."""
    radius, base = draw.sizes((0.29, 0.34), (0.95, 1.05))
    paint, dark, metal = draw.plastic(), draw.dark(), draw.metal()
    rear, head = (-base / 2, 0.0, radius), (base / 2, 0.0, radius)
    crank, seat = (-0.06, 0.0, radius * 0.9), (-0.2, 0.0, radius + 0.42)
    neck, low_neck = (base / 2 - 0.14, 0.0, radius + 0.44), (base / 2 - 0.11, 0.0, radius + 0.32)
    saddle, x, z = (-0.23, 0.0, radius + 0.5), neck[0] + 0.02, neck[2] + 0.1
    tubes = [(rear, crank), (rear, seat), (crank, seat), (crank, low_neck), (low_neck, head)]
    tubes += [(low_neck, neck), *([(seat, neck)] if draw.chance(0.7) else [])]
    frame = [rod(start, end, 0.019) for start, end in tubes]
    wheels = [_wheel(radius, hub) for hub in (rear, head)]
    black = [tyre for tyre, _ in wheels]
    black.append(ellipsoid((0.14, 0.075, 0.035), saddle, 10))
    bright = [part for _, parts in wheels for part in parts]
    bar = [(x - 0.14, -0.27, z), (x, -0.14, z + 0.02), (x, 0.14, z + 0.02), (x - 0.14, 0.27, z)]
    bright += [
        rod(seat, saddle, 0.013),
        rod(neck, (x, 0, z), 0.014),
        tube(bar, 0.013),
        knob(0.08, 0.02, (crank[0], 0.05, crank[2]), 14),
    ]
    for side in (-1, 1):
        foot = (crank[0] + side * 0.11, side * 0.07, crank[2] - side * 0.1)
        bright.append(rod((crank[0], side * 0.05, crank[2]), foot, 0.01))
        black.append(box((0.08, 0.09, 0.02), (foot[0], foot[1] + side * 0.04, foot[2])))
    return assemble("bicycle", (paint, frame), (dark, black), (metal, bright))


def _wheel(radius: float, hub: tuple[float, float, float]) -> tuple[Mesh, list[Mesh]]:
    """A tyre, and its rim, axle and spokes."""
    x, _, z = hub
    tyre, rim = (
        torus(radius - inset, thick, segments=24).rotated("x", 90).translated(*hub)
        for inset, thick in ((0.022, 0.022), (0.05, 0.009))
    )
    reach, turns = radius * 0.86, np.linspace(0, 2 * np.pi, 10, endpoint=False)
    ends = [(x + reach * np.cos(turn), 0.0, z + reach * np.sin(turn)) for turn in turns]
    axle = knob(0.025, 0.1, (x, 0.05, z), 8)
    return tyre, [rim, axle, *(rod(hub, end, 0.004, 4) for end in ends)]


def guitar(draw: Sampler) -> Model:
    """A guitar that leans back on a small stand: waisted body, sound hole, neck and head."""
    length, thick = draw.sizes((0.42, 0.5), (0.07, 0.1))
    wood, dark_wood = draw.wood(), draw.material("wood", 0.5, (0.22, 0.13, 0.08))
    t = np.linspace(0, 2 * np.pi, 28, endpoint=False)
    z, waist = (1 - np.cos(t)) / 2, 0.11
    lower, upper = draw.sizes((0.19, 0.22), (0.13, 0.155))
    widths = [0.05, 0.7 * lower, lower, waist, upper, 0.75 * upper, 0.03]
    half = np.interp(z, [0, 0.08, 0.28, 0.58, 0.8, 0.94, 1.0], widths)
    outline = np.stack([half * np.sign(np.sin(t)), z * length], axis=1)
    outline[[0, 14], 0] = 0.0
    body = prism(outline[::-1], thick).rotated("x", 90)
    front, neck_l = -thick, length * 0.95

    def block(x: float, y0: float, y1: float, z0: float, z1: float) -> Mesh:
        """A box on the body's front, symmetric about x = 0."""
        return box_between((-x, front + y0, z0), (x, front + y1, z1))

    dark = [
        block(0.028, -0.012, 0.02, length * 0.75, length + neck_l * 0.8),  # neck
        block(0.045, -0.005, 0.02, length + neck_l * 0.78, length + neck_l),  # head
        knob(0.05, 0.01, (0, front, length * 0.66), 16),  # sound hole
        block(0.07, -0.02, 0.0, length * 0.28, length * 0.32),  # bridge
    ]
    pegs = [
        rod(
            (x * 0.04, front, length + neck_l * k), (x * 0.07, front, length + neck_l * k), 0.009, 6
        )
        for x in (-1, 1)
        for k in (0.83, 0.89, 0.95)
    ]
    stand = [
        *(rod((x * 0.16, -0.16, 0.0), (x * 0.1, -0.02, 0.12), 0.012) for x in (-1, 1)),
        rod((0, 0.24, 0.0), (0, 0.06, 0.42), 0.012),
        rod((-0.13, -0.08, 0.09), (0.13, -0.08, 0.09), 0.012),
    ]
    groups = (wood, [body]), (dark_wood, dark), (draw.metal(), pegs)
    leaning = [
        (material, [mesh.rotated("x", -12).translated(0, 0, 0.09) for mesh in meshes])
        for material, meshes in groups
    ]
    return assemble("guitar", *leaning, (draw.dark(), stand))


def teddy_bear(draw: Sampler) -> Model:
    """A sitting bear: belly, head with round ears and a muzzle, four limbs."""
    scale = draw.size(0.36, 0.46) / 0.42
    hue = draw.uniform(0.5, 1.1)
    brown = (0.7 * hue, 0.5 * hue, 0.3 * hue) if draw.chance(0.55) else draw.colour()
    fur = draw.material("noise", 0.15, brown)
    light, dark = draw.material("noise", 0.15, draw.grey(0.7, 0.95, tint=0.25)), draw.dark()
    body = [
        ellipsoid((0.11, 0.095, 0.13), (0, 0, 0.13), 12),
        ellipsoid((0.095, 0.088, 0.085), (0, -0.01, 0.315), 12),
    ]
    for side in (-1, 1):
        arm = ellipsoid((0.04, 0.04, 0.085), segments=8).rotated("y", side * 40)
        body += [
            ellipsoid((0.035, 0.02, 0.035), (side * 0.075, 0.0, 0.385), 8),
            arm.rotated("x", -25).translated(side * 0.125, -0.04, 0.18),
            ellipsoid((0.048, 0.1, 0.048), (side * 0.085, -0.12, 0.05), 8),
        ]
    pale = [
        ellipsoid((0.042, 0.035, 0.032), (0, -0.09, 0.295), 8),
        ellipsoid((0.07, 0.03, 0.085), (0, -0.075, 0.13), 10),
        *(ellipsoid((0.036, 0.012, 0.036), (x, -0.215, 0.055), 8) for x in (-0.085, 0.085)),
    ]
    black = [
        ellipsoid((0.015, 0.012, 0.012), (0, -0.125, 0.305), 6),
        *(ellipsoid((0.012, 0.01, 0.012), (x, -0.09, 0.34), 6) for x in (-0.035, 0.035)),
    ]
    groups = [
        (material, [mesh.scaled(scale, scale, scale) for mesh in meshes])
        for material, meshes in ((fur, body), (light, pale), (dark, black))
    ]
    return assemble("teddy bear", *groups)


def ball(draw: Sampler) -> Model:
    """A ball with coloured segments, or patches as a football has."""
    radius = draw.size(0.11, 0.15)
    sphere = ellipsoid((radius, radius, radius), (0, 0, radius), 18)
    first, second = draw.plastic(), draw.plastic()
    centres = sphere.vertices[sphere.faces].mean(axis=1) - (0, 0, radius)
    if draw.chance(0.5):
        sector = np.floor(np.degrees(np.arctan2(centres[:, 1], centres[:, 0])) / 60).astype(int) % 2
    else:
        golden = (1 + 5**0.5) / 2
        poles = np.array([(0, s, t * golden) for s in (-1, 1) for t in (-1, 1)])
        poles = np.concatenate([poles, poles[:, [2, 0, 1]], poles[:, [1, 2, 0]]])
        cosine = (centres @ poles.T).max(axis=1) / radius / np.linalg.norm(poles[0])
        sector = (cosine > 0.9).astype(int)
    axis, tilt = draw.choice(["x", "y"]), draw.uniform(0, 90)
    halves = [
        from_faces(sphere.vertices, sphere.faces[sector == side])
        .translated(0, 0, -radius)
        .rotated(axis, tilt)
        .translated(0, 0, radius)
        for side in (0, 1)
    ]
    return assemble("ball", (first, halves[:1]), (second, halves[1:]))
