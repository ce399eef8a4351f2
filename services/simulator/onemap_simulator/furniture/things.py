"""Small things: on tables, on shelves, on the floor."""

from __future__ import annotations

import numpy as np

from onemap_simulator.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    from_faces,
    lathe,
    prism,
    ring,
    rod,
    soft_box,
    span,
    tube,
)
from onemap_simulator.model import Model, assemble
from onemap_simulator.pick import Pick


def bottle(pick: Pick) -> Model:
    """A tall body, a shoulder, a thin neck with a cap, and a label."""
    height, radius = pick.size(0.28, 0.36), pick.size(0.04, 0.055)
    shoulder = height * pick.between(0.5, 0.68)
    neck = radius * pick.between(0.3, 0.42)
    profile = [(radius * 0.9, 0), (radius, 0.01), (radius, shoulder), (neck, height * 0.78)]
    body = lathe([*profile, (neck, height * 0.93)], segments=14)
    cap = cylinder(neck * 1.2, height * 0.08, (0, 0, height * 0.92), 10)
    label = cylinder(radius * 1.015, shoulder * 0.5, (0, 0, shoulder * 0.25), 14)
    return assemble(
        "bottle", (pick.plastic(), [body]), (pick.plastic(), [cap]), (pick.fabric(), [label])
    )


def cup(pick: Pick) -> Model:
    """A mug with a handle, generously sized, at times on a saucer."""
    height, radius = pick.size(0.11, 0.14), pick.size(0.05, 0.065)
    foot = radius * pick.between(0.65, 1.0)
    lift = 0.014 if pick.chance(0.4) else 0.0
    wall = [(foot, 0), (radius, height), (radius * 0.88, height), (foot * 0.85, 0.015), (0, 0.015)]
    angle = np.linspace(-np.pi / 2, np.pi / 2, 7)
    loop = [
        (radius * 0.85 + height * 0.35 * np.cos(a), 0.0, height * (0.5 + 0.32 * np.sin(a)))
        for a in angle
    ]
    meshes = [lathe(wall, (0, 0, lift)), tube(loop, 0.011).moved(0, 0, lift)]
    if lift:
        meshes.append(lathe([(radius * 0.8, 0), (radius * 1.7, 0.018), (radius * 0.8, 0.012)]))
    coffee = cylinder(radius * 0.8, 0.005, (0, 0, lift + height * 0.8), 12)
    glaze = pick.plastic() if pick.chance(0.6) else pick.fabric()
    return assemble("cup", (glaze, meshes), (pick.of("plain", 0.5, (0.25, 0.14, 0.08)), [coffee]))


def bowl(pick: Pick) -> Model:
    """A wide open bowl, empty or with fruit."""
    radius, height = pick.size(0.13, 0.18), pick.size(0.08, 0.11)
    foot = radius * 0.45
    outer = [(foot, 0), (foot, 0.012), (radius * 0.8, height * 0.5), (radius, height)]
    inner = [(radius * 0.94, height), (radius * 0.72, height * 0.5), (0.0, 0.025)]
    groups = [(pick.ceramic() if pick.chance(0.4) else pick.wood(), [lathe([*outer, *inner])])]
    if pick.chance(0.55):
        fruit: list[list[Mesh]] = [[], []]
        for index in range(pick.count(3, 6)):
            angle, size = index * 1.25, pick.between(0.038, 0.048)
            at = (radius * 0.45 * np.cos(angle), radius * 0.45 * np.sin(angle), height * 0.8)
            fruit[index % 2].append(ellipsoid((size, size, size), at, 8))
        groups += [(pick.plastic(), fruit[0]), (pick.plastic(), fruit[1])]
    return assemble("bowl", *groups)


def book(pick: Pick) -> Model:
    """A pile of two to five books, each with covers, a spine and paper edges."""
    z, pages = 0.0, []
    groups = []
    for _ in range(pick.count(2, 5)):
        width, depth, thick = pick.size(0.2, 0.27), pick.size(0.15, 0.2), pick.size(0.03, 0.055)
        turn = pick.between(-15, 15)
        covers = [
            box((width, depth, 0.006), (0, 0, 0)),
            box((width, depth, 0.006), (0, 0, thick - 0.006)),
            span((-width / 2, -depth / 2, 0.0), (width / 2, -depth / 2 + 0.008, thick)),
        ]
        block = span(
            (-width / 2 + 0.006, -depth / 2, 0.006),
            (width / 2 - 0.006, depth / 2 - 0.008, thick - 0.006),
        )
        pages.append(block.turned("z", turn).moved(0, 0, z))
        cover = pick.plastic() if pick.chance(0.7) else pick.fabric()
        groups.append((cover, [mesh.turned("z", turn).moved(0, 0, z) for mesh in covers]))
        z += thick
    return assemble("book", (pick.of("stripes", 0.02, (0.93, 0.9, 0.8)), pages), *groups)


def cardboard_box(pick: Pick) -> Model:
    """A carton, closed with tape or open with four flaps."""
    width, depth, height = pick.size(0.32, 0.5), pick.size(0.26, 0.38), pick.size(0.22, 0.36)
    tan = pick.between(0.75, 1.1)
    brown = (0.72 * tan, 0.55 * tan, 0.36 * tan)
    card = pick.of("noise", 0.3, brown) if pick.chance(0.6) else pick.plastic()
    if pick.chance(0.5):
        tape = [
            box((width + 0.004, 0.05, 0.006), (0, 0, height)),
            box((width + 0.006, 0.05, height * 0.3), (0, 0, height * 0.7)),
        ]
        label = box((0.14, 0.005, 0.1), (width * 0.15, -depth / 2, height * 0.4))
        body = [box((width, depth, height))]
        return assemble("box", (card, body), (pick.pale(), [*tape, label]))
    t = 0.008
    walls = [
        box((width, depth, t)),
        *(box((width, t, height), (0, s * (depth - t) / 2, 0)) for s in (-1, 1)),
        *(box((t, depth, height), (s * (width - t) / 2, 0, 0)) for s in (-1, 1)),
    ]
    for s in (-1, 1):
        flap = box((width, depth * 0.45, t), (0, s * depth * 0.225, 0))
        walls.append(flap.turned("x", -s * 25).moved(0, s * depth / 2, height))
        flap = box((width * 0.3, depth, t), (s * width * 0.15, 0, 0))
        walls.append(flap.turned("y", s * 35).moved(s * width / 2, 0, height))
    return assemble("box", (card, walls))


def basket(pick: Pick) -> Model:
    """A woven basket, round or oval, with two handles or a rim, at times with cloth in it."""
    radius, height = pick.size(0.18, 0.25), pick.size(0.24, 0.34)
    hue = pick.between(0.6, 1.1)
    straw = (0.78 * hue, 0.6 * hue, 0.36 * hue) if pick.chance(0.6) else pick.colour()
    weave = pick.of("checks" if pick.chance(0.5) else "weave", 0.12, straw)
    low = radius * pick.between(0.7, 0.95)
    rows = 8
    profile = []
    for row in range(rows + 1):  # bulging courses of wicker
        share = row / rows
        r = low + (radius - low) * share
        profile += [(r, height * share), (r + 0.012, height * (share + 0.4 / rows))]
    profile = [*profile[:-1], (radius - 0.02, height), (low - 0.02, 0.03), (0.0, 0.03)]
    oval = pick.between(0.75, 1.0)
    body = [lathe(profile, segments=18).stretched(1.0, oval, 1.0)]
    angle = np.linspace(0, np.pi, 7)
    for side in (-1, 1):
        loop = [(side * radius * 0.97, 0.07 * np.cos(a), height + 0.06 * np.sin(a)) for a in angle]
        body.append(tube(loop, 0.014))
    groups = [(weave, body)]
    if pick.chance(0.5):
        cloth = ellipsoid((radius * 0.85, radius * oval * 0.85, 0.08), (0, 0, height - 0.02), 10)
        groups.append((pick.fabric(), [cloth]))
    return assemble("basket", *groups)


def trash_can(pick: Pick) -> Model:
    """A bin: a tapered bucket with a dark inside, or a pedal bin with a domed lid."""
    radius, height = pick.size(0.13, 0.18), pick.size(0.32, 0.48)
    skin = pick.metal() if pick.chance(0.5) else pick.plastic()
    dark = pick.dark()
    if pick.chance(0.5):
        body = lathe(
            [
                (radius * 0.8, 0),
                (radius, height),
                (radius * 1.05, height),
                (radius * 0.95, height - 0.02),
                (radius * 0.75, 0.05),
            ]
        )
        bag = lathe(
            [
                (radius * 1.07, height - 0.07),
                (radius * 1.08, height + 0.012),
                (radius * 0.92, height + 0.005),
                (0, height - 0.12),
            ]
        )
        return assemble(
            "trash can", (skin, [body]), (dark if pick.chance(0.6) else pick.pale(), [bag])
        )
    body = cylinder(radius, height, (0, 0, 0.02), 18)
    lid = ellipsoid((radius * 1.03, radius * 1.03, 0.09), (0, 0, height + 0.02), 16)
    band = [cylinder(radius * 1.03, 0.03, (0, 0, height - 0.01), 18), cylinder(radius * 1.02, 0.03)]
    pedal = box((0.09, 0.07, 0.02), (0, -radius - 0.02, 0.015))
    return assemble("trash can", (skin, [body, lid]), (dark, [*band, pedal]))


def suitcase(pick: Pick) -> Model:
    """An upright trolley case: ribbed shell, wheels, a side grip and a pulled-out handle."""
    width, depth, height = pick.size(0.38, 0.48), pick.size(0.22, 0.28), pick.size(0.55, 0.7)
    shell, dark, metal = (
        pick.plastic() if pick.chance(0.6) else pick.fabric(),
        pick.dark(),
        pick.metal(),
    )
    body = [soft_box((width, depth, height), (0, 0, 0.05), 0.05)]
    for x in np.linspace(-width * 0.32, width * 0.32, pick.count(3, 6)):
        body.append(
            soft_box(
                (0.025, depth + 0.02, height * 0.86), (float(x), 0, 0.05 + height * 0.07), 0.012
            )
        )
    trim = [box((width + 0.006, 0.02, height * 0.9), (0, 0, 0.05 + height * 0.05))]
    wheels = [
        cylinder(0.03, 0.03, segments=10)
        .turned("y", 90)
        .moved(x * width * 0.36 - 0.015, y * depth * 0.33, 0.03)
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    top, pull = height + 0.05, pick.size(0.12, 0.35)
    bars = [rod((x * 0.09, 0.04, top - 0.02), (x * 0.09, 0.04, top + pull), 0.01) for x in (-1, 1)]
    grip = [soft_box((0.24, 0.035, 0.035), (0, 0.04, top + pull - 0.015), 0.015)]
    grip.append(
        tube(
            [
                (-0.08, -0.03, top - 0.01),
                (-0.06, -0.03, top + 0.035),
                (0.06, -0.03, top + 0.035),
                (0.08, -0.03, top - 0.01),
            ],
            0.012,
        )
    )
    return assemble("suitcase", (shell, body), (metal, bars), (dark, [*trim, *wheels, *grip]))


def bicycle(pick: Pick) -> Model:
    """Two spoked wheels, a diamond or step-through frame, saddle, handlebar and pedals; along x."""
    radius, base = pick.size(0.29, 0.34), pick.size(0.95, 1.05)
    paint, dark, metal = pick.plastic(), pick.dark(), pick.metal()
    rear, head = (-base / 2, 0.0, radius), (base / 2, 0.0, radius)
    crank, seat = (-0.06, 0.0, radius * 0.9), (-0.2, 0.0, radius + 0.42)
    neck, low_neck = (base / 2 - 0.14, 0.0, radius + 0.44), (base / 2 - 0.11, 0.0, radius + 0.32)
    tyres, spokes = [], []
    for hub in (rear, head):
        tyres.append(ring(radius - 0.022, 0.022, segments=24).turned("x", 90).moved(*hub))
        spokes.append(ring(radius - 0.05, 0.009, segments=24).turned("x", 90).moved(*hub))
        spokes.append(cylinder(0.025, 0.1, segments=8).turned("x", 90).moved(hub[0], 0.05, hub[2]))
        for angle in np.linspace(0, 2 * np.pi, 10, endpoint=False):
            rim = (
                hub[0] + radius * 0.86 * np.cos(angle),
                0.0,
                hub[2] + radius * 0.86 * np.sin(angle),
            )
            spokes.append(rod(hub, rim, 0.004, 4))
    pairs = [
        (rear, crank),
        (rear, seat),
        (crank, seat),
        (crank, low_neck),
        (low_neck, head),
        (low_neck, neck),
    ]
    if pick.chance(0.7):
        pairs.append((seat, neck))
    frame = [rod(a, b, 0.019) for a, b in pairs]
    saddle_at = (-0.23, 0.0, radius + 0.5)
    black = [ellipsoid((0.14, 0.075, 0.035), saddle_at, 10)]
    bars = [rod(seat, saddle_at, 0.013), rod(neck, (neck[0] + 0.02, 0, neck[2] + 0.1), 0.014)]
    grip = (neck[0] + 0.02, neck[2] + 0.1)
    bars.append(
        tube(
            [
                (grip[0] - 0.14, -0.27, grip[1]),
                (grip[0], -0.14, grip[1] + 0.02),
                (grip[0], 0.14, grip[1] + 0.02),
                (grip[0] - 0.14, 0.27, grip[1]),
            ],
            0.013,
        )
    )
    bars.append(cylinder(0.08, 0.02, segments=14).turned("x", 90).moved(crank[0], 0.05, crank[2]))
    for side in (-1, 1):
        foot = (crank[0] + side * 0.11, side * 0.07, crank[2] - side * 0.1)
        bars.append(rod((crank[0], side * 0.05, crank[2]), foot, 0.01))
        black.append(box((0.08, 0.09, 0.02), (foot[0], foot[1] + side * 0.04, foot[2])))
    return assemble("bicycle", (paint, frame), (dark, [*tyres, *black]), (metal, [*spokes, *bars]))


def guitar(pick: Pick) -> Model:
    """A guitar that leans back on a small stand: waisted body, sound hole, neck and head."""
    length, thick = pick.size(0.42, 0.5), pick.size(0.07, 0.1)
    wood, dark_wood = pick.wood(), pick.of("wood", 0.5, (0.22, 0.13, 0.08))
    t = np.linspace(0, 2 * np.pi, 28, endpoint=False)
    z = (1 - np.cos(t)) / 2
    lower, upper, waist = pick.size(0.19, 0.22), pick.size(0.13, 0.155), 0.11
    half = np.interp(
        z,
        [0, 0.08, 0.28, 0.58, 0.8, 0.94, 1.0],
        [0.05, 0.7 * lower, lower, waist, upper, 0.75 * upper, 0.03],
    )
    outline = np.stack([half * np.sign(np.sin(t)) * np.abs(np.sign(np.sin(t))), z * length], axis=1)
    outline[0, 0] = outline[14, 0] = 0.0
    body = prism(outline[::-1], thick).turned("x", 90)
    hole = cylinder(0.05, 0.01, segments=16).turned("x", 90).moved(0, -thick, length * 0.66)
    neck_l = length * 0.95
    neck = span(
        (-0.028, -thick - 0.012, length * 0.75), (0.028, -thick + 0.02, length + neck_l * 0.8)
    )
    head = span(
        (-0.045, -thick - 0.005, length + neck_l * 0.78), (0.045, -thick + 0.02, length + neck_l)
    )
    bridge = span((-0.07, -thick - 0.02, length * 0.28), (0.07, -thick, length * 0.32))
    pegs = [
        rod(
            (x * 0.04, -thick, length + neck_l * k),
            (x * 0.07, -thick, length + neck_l * k),
            0.009,
            6,
        )
        for x in (-1, 1)
        for k in (0.83, 0.89, 0.95)
    ]
    lean = lambda mesh: mesh.turned("x", -12).moved(0, 0, 0.09)  # noqa: E731
    stand = [rod((x * 0.16, -0.16, 0.0), (x * 0.1, -0.02, 0.12), 0.012) for x in (-1, 1)] + [
        rod((0, 0.24, 0.0), (0, 0.06, 0.42), 0.012),
        rod((-0.13, -0.08, 0.09), (0.13, -0.08, 0.09), 0.012),
    ]
    return assemble(
        "guitar",
        (wood, [lean(body)]),
        (dark_wood, [lean(m) for m in (neck, head, hole, bridge)]),
        (pick.metal(), [lean(m) for m in pegs]),
        (pick.dark(), stand),
    )


def teddy_bear(pick: Pick) -> Model:
    """A sitting bear: belly, head with round ears and a muzzle, four limbs."""
    scale = pick.size(0.36, 0.46) / 0.42
    hue = pick.between(0.5, 1.1)
    fur = pick.of(
        "noise", 0.15, (0.7 * hue, 0.5 * hue, 0.3 * hue) if pick.chance(0.55) else pick.colour()
    )
    light, dark = pick.of("noise", 0.15, pick.grey(0.7, 0.95, tint=0.25)), pick.dark()
    body = [
        ellipsoid((0.11, 0.095, 0.13), (0, 0, 0.13), 12),
        ellipsoid((0.095, 0.088, 0.085), (0, -0.01, 0.315), 12),
    ]
    for side in (-1, 1):
        body += [
            ellipsoid((0.035, 0.02, 0.035), (side * 0.075, 0.0, 0.385), 8),
            ellipsoid((0.04, 0.04, 0.085), (0, 0, 0), 8)
            .turned("y", side * 40)
            .turned("x", -25)
            .moved(side * 0.125, -0.04, 0.18),
            ellipsoid((0.048, 0.1, 0.048), (side * 0.085, -0.12, 0.05), 8),
        ]
    pale = [
        ellipsoid((0.042, 0.035, 0.032), (0, -0.09, 0.295), 8),
        ellipsoid((0.07, 0.03, 0.085), (0, -0.075, 0.13), 10),
    ]
    pale += [ellipsoid((0.036, 0.012, 0.036), (side * 0.085, -0.215, 0.055), 8) for side in (-1, 1)]
    black = [ellipsoid((0.015, 0.012, 0.012), (0, -0.125, 0.305), 6)]
    black += [ellipsoid((0.012, 0.01, 0.012), (side * 0.035, -0.09, 0.34), 6) for side in (-1, 1)]
    groups = [
        (material, [mesh.stretched(scale, scale, scale) for mesh in meshes])
        for material, meshes in ((fur, body), (light, pale), (dark, black))
    ]
    return assemble("teddy bear", *groups)


def ball(pick: Pick) -> Model:
    """A ball with coloured segments, or patches as a football has."""
    radius = pick.size(0.11, 0.15)
    sphere = ellipsoid((radius, radius, radius), (0, 0, radius), 18)
    first, second = pick.plastic(), pick.plastic()
    centres = sphere.vertices[sphere.faces].mean(axis=1) - (0, 0, radius)
    if pick.chance(0.5):
        sector = np.floor(np.degrees(np.arctan2(centres[:, 1], centres[:, 0])) / 60).astype(int) % 2
    else:
        golden = (1 + 5**0.5) / 2
        poles = np.array([(0, s, t * golden) for s in (-1, 1) for t in (-1, 1)])
        poles = np.concatenate([poles, poles[:, [2, 0, 1]], poles[:, [1, 2, 0]]])
        cosine = (centres @ poles.T).max(axis=1) / radius / np.linalg.norm(poles[0])
        sector = (cosine > 0.9).astype(int)
    halves = [from_faces(sphere.vertices, sphere.faces[sector == side]) for side in (0, 1)]
    axis, tilt = pick.one(["x", "y"]), pick.between(0, 90)
    turned = [m.moved(0, 0, -radius).turned(axis, tilt).moved(0, 0, radius) for m in halves]
    return assemble("ball", (first, [turned[0]]), (second, [turned[1]]))
