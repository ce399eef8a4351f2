"""Kitchen cabinets, sinks and appliances that stand in a row, small appliances, tableware.

Tableware is oversized, so that it is visible in a small image.
"""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Material,
    Mesh,
    Model,
    Top,
    Vec,
    assemble,
    box,
    box_between,
    cylinder,
    ellipsoid,
    knob,
    lathe,
    rod,
    rounded_box,
    spread,
    top,
    torus,
    tube,
)
from onemap_simulator.generation.style import Sampler

DEPTH_M = 0.6
COUNTER_M = 0.9
FRONT_Y = -DEPTH_M / 2
KitchenLook = tuple[Material, Material, Material]  # body, worktop, handles


def kitchen_look(draw: Sampler) -> KitchenLook:
    """Body, worktop and handles that all cabinets of one kitchen share."""
    wooden = draw.chance(0.5)
    worktop = draw.wood() if wooden else draw.material("marble", 0.8, draw.colour())
    return (draw.wood(), worktop, draw.metal())


def _worktop(width: float) -> tuple[list[Mesh], Top]:
    """The board on a base unit, and where small objects stand on it."""
    board = box((width, DEPTH_M + 0.02, 0.04), (0, 0, COUNTER_M - 0.04))
    return [board], Top(-width / 2, -0.2, width / 2, 0.26, COUNTER_M)


def _handle(draw: Sampler, length: float, at: Vec, *, upright: bool) -> Mesh:
    """A bar handle in front of a door at y, upright or level."""
    thick = draw.uniform(0.018, 0.028)
    size = (thick, 0.035, length) if upright else (length, 0.035, thick)
    x, y, z = at
    return box(size, (x, y - 0.017, z - size[2] / 2))


def kitchen_cabinet(draw: Sampler, width: float, look: KitchenLook) -> Model:
    """A base cabinet with doors or drawers under a worktop."""
    body, worktop, metal = look
    meshes = [
        box((width, DEPTH_M - 0.03, COUNTER_M - 0.14), (0, 0.015, 0.1)),
        box((width, DEPTH_M - 0.1, 0.1), (0, 0.03, 0)),
    ]
    leaves, handles = _fronts(draw, width, (0.11, COUNTER_M - 0.05), FRONT_Y)
    board, surface = _worktop(width)
    groups = (body, [*meshes, *leaves]), (worktop, board), (metal, handles)
    return assemble("kitchen cabinet", *groups, tops=[surface])


def wall_cabinet(draw: Sampler, width: float, look: KitchenLook) -> Model:
    """A shallow cabinet to hang above a worktop; z = 0 is its underside."""
    height, depth = 0.62, 0.34
    leaves, handles = _fronts(draw, width, (0.01, height - 0.01), -depth / 2, doors_only=True)
    body = box((width, depth - 0.03, height), (0, 0.015, 0))
    return assemble("kitchen cabinet", (look[0], [body, *leaves]), (look[2], handles))


def _fronts(
    draw: Sampler, width: float, z: tuple[float, float], y: float, *, doors_only: bool = False
) -> tuple[list[Mesh], list[Mesh]]:
    low, high = z
    leaves, handles = [], []
    if not doors_only and draw.chance(0.4):
        count = draw.integer(3, 4)
        tall = (high - low) / count
        for row in range(count):
            at = (0.0, y + 0.012, low + row * tall)
            leaves.append(rounded_box((width - 0.012, 0.03, tall - 0.012), at, 0.006))
            at = (0.0, y, low + (row + 0.75) * tall)
            handles.append(_handle(draw, width * 0.45, at, upright=False))
        return leaves, handles
    count = 2 if width > 0.65 else 1
    each = width / count
    for x, side in zip(spread(count, each), (1, -1), strict=False):
        leaves.append(rounded_box((each - 0.012, 0.03, high - low), (x, y + 0.012, low), 0.006))
        at = (x + side * (each / 2 - 0.06), y, low + 0.16 if doors_only else high - 0.16)
        handles.append(_handle(draw, 0.16, at, upright=True))
    return leaves, handles


def kitchen_sink(draw: Sampler, width: float, look: KitchenLook) -> Model:
    """A basin with an apron front, set in the worktop's row, with an arched tap."""
    if draw.chance(0.5):
        basin = draw.ceramic()
    else:
        basin = draw.material("brushed", 0.5, draw.grey(0.6, 0.85))
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
    leaves, handles = _fronts(draw, width, (0.1, low - 0.01), FRONT_Y, doors_only=True)
    drain = cylinder(0.035, 0.01, (0, 0, low + 0.05), 12)
    return assemble(
        "sink",
        (basin, meshes),
        (look[0], [cabinet, *leaves]),
        (look[2], handles),
        (draw.metal(), [*tap(draw, (0, y1 - 0.07, high)), drain]),
    )


def tap(draw: Sampler, at: Vec) -> list[Mesh]:
    """An arched or angular tap that reaches towards -y, with two handles."""
    reach, rise = draw.sizes((0.15, 0.2), (0.18, 0.28))
    if draw.chance(0.6):
        angle = np.linspace(0, np.pi, 8)
        arch = [(0.0, -reach / 2 * (1 - np.cos(a)), rise * 0.6 + 0.1 * np.sin(a)) for a in angle]
        meshes = [tube([(0, 0, 0), (0, 0, rise * 0.3), *arch], 0.014)]
    else:
        meshes = [rod((0, 0, 0), (0, 0, rise * 0.7), 0.018)]
        meshes.append(rod((0, 0.015, rise * 0.68), (0, -reach, rise * 0.68), 0.014))
    for x in (-0.09, 0.09):
        meshes.append(cylinder(0.018, 0.06, (x, 0, 0), 8))
        meshes.append(box((0.06, 0.014, 0.014), (x, 0, 0.055)))
    return [mesh.translated(*at) for mesh in meshes]


def oven(draw: Sampler) -> Model:
    """A cooker: hob with four rings on top, knobs, a door with a dark window and a handle bar."""
    width = draw.size(0.56, 0.62)
    casing, dark, metal = draw.enamel(), draw.dark(), draw.metal()
    y, z, low, high = FRONT_Y, COUNTER_M, draw.size(0.16, 0.24), 0.72
    body = [
        box((width, DEPTH_M - 0.04, z - 0.03), (0, 0.02, 0)),
        rounded_box((width - 0.03, 0.05, high - low), (0, y + 0.025, low), 0.01),
    ]
    plate = [box((width, DEPTH_M, 0.03), (0, 0, z - 0.03))]
    glass = box((width * 0.68, 0.01, (high - low) * 0.55), (0, y - 0.004, low + 0.09))
    hob, knobs = [], []
    for x, depth in ((-0.14, -0.13), (-0.14, 0.13), (0.14, -0.13), (0.14, 0.13)):
        radius = draw.uniform(0.07, 0.1)
        hob.append(cylinder(radius, 0.018, (x, depth, z), 16))
        knobs.append(torus(radius * 0.7, 0.008, (x, depth, z + 0.02), 14))
    places = np.linspace(-width * 0.36, width * 0.36, draw.integer(4, 6))
    knobs += [knob(0.022, 0.035, (x, y + 0.02, 0.8)) for x in places]
    bar = _handle(draw, width * 0.8, (0, y - 0.02, high - 0.06), upright=False)
    if draw.chance(0.4):
        body.append(box((width, 0.03, 0.14), (0, DEPTH_M / 2 - 0.015, z)))
    hob_top = (dark if draw.chance(0.6) else draw.metal(), plate)
    return assemble("oven", (casing, body), hob_top, (dark, [glass, *hob]), (metal, [bar, *knobs]))


def dishwasher(draw: Sampler, worktop: Material) -> Model:
    """A flush front with a control strip, a long handle and a plinth, under a worktop."""
    width, y = draw.size(0.56, 0.61), FRONT_Y
    casing, dark, metal = draw.enamel(), draw.dark(), draw.metal()
    body = [
        box((width, DEPTH_M - 0.04, 0.84), (0, 0.02, 0.02)),
        rounded_box((width - 0.015, 0.04, 0.6), (0, y + 0.02, 0.12), 0.008),
    ]
    strip = [box((width - 0.015, 0.04, 0.11), (0, y + 0.02, 0.74))]
    lamps = [box((0.02, 0.01, 0.012), (x, y - 0.003, 0.79)) for x in (0.08, 0.12, 0.16, 0.2)]
    screen = [box((0.1, 0.01, 0.04), (-0.15, y - 0.003, 0.775)), box((width, 0.5, 0.1))]
    bar = [_handle(draw, width * 0.85, (0, y - 0.015, 0.69), upright=False)]
    board, surface = _worktop(width)
    return assemble(
        "dishwasher",
        (casing, body),
        (dark if draw.chance(0.5) else draw.metal(), strip),
        (draw.pale(), lamps),
        (dark, screen),
        (metal, bar),
        (worktop, board),
        tops=[surface],
    )


def refrigerator(draw: Sampler) -> Model:
    """A tall box split into two doors, above each other or side by side, with long handles."""
    width, depth, height = draw.sizes((0.58, 0.72), (0.6, 0.68), (1.6, 1.95))
    casing, metal, y = draw.enamel(), draw.metal(), -depth / 2
    body = [box((width, depth - 0.07, height - 0.05), (0, 0.035, 0.05))]
    handles = []
    if width > 0.66 and draw.chance(0.5):
        size = (width / 2 - 0.01, 0.07, height - 0.06)
        for side in (-1, 1):
            body.append(rounded_box(size, (side * width / 4, y + 0.035, 0.06), 0.015))
            at = (side * 0.05, y - 0.01, height * 0.55)
            handles.append(_handle(draw, height * 0.4, at, upright=True))
    else:
        split = height * draw.choice([0.35, 0.62, 0.68])
        x = draw.choice([-1, 1]) * (width / 2 - 0.06)
        below, above = split - 0.008, split + 0.008
        for low, high, z in ((0.06, below, below - 0.26), (above, height, above + 0.26)):
            body.append(rounded_box((width, 0.07, high - low), (0, y + 0.035, low), 0.02))
            handles.append(_handle(draw, 0.32, (x, y - 0.01, z), upright=True))
    inside = [
        box((width - 0.02, depth - 0.1, height - 0.07), (0, 0.02, 0.06)),
        box((width - 0.06, depth - 0.12, 0.06)),
    ]
    return assemble("refrigerator", (casing, body), (metal, handles), (draw.dark(), inside))


def microwave(draw: Sampler) -> Model:
    """A box with a dark window on the left, a keypad on the right and a handle between."""
    width, depth, height = draw.sizes((0.46, 0.54), (0.32, 0.38), (0.27, 0.32))
    y, pad = -depth / 2, width * 0.24
    x = width / 2 - pad / 2
    casing, dark = draw.enamel(), draw.dark()
    body = [rounded_box((width, depth, height), (0, 0, 0.015), 0.015)]
    window = [box((width - pad - 0.06, 0.012, height - 0.08), (-pad / 2 - 0.005, y, 0.055))]
    keypad = [box((pad - 0.03, 0.012, height - 0.06), (x, y, 0.045))]
    keys = [
        box((0.018, 0.012, 0.014), (x + dx, y - 0.006, 0.07 + row * 0.032))
        for dx in (-0.028, 0.0, 0.028)
        for row in range(4)
    ]
    screen = box((pad * 0.6, 0.012, 0.03), (x, y - 0.006, height - 0.06))
    at = (width / 2 - pad - 0.012, y, height / 2 + 0.015)
    bar = _handle(draw, height * 0.75, at, upright=True)
    return assemble(
        "microwave",
        (casing, body),
        (dark, window),
        (draw.material("plain", 0.5, draw.grey(0.2, 0.5)), keypad),
        (draw.pale(), [*keys, screen]),
        (draw.metal(), [bar]),
        tops=[top(width, depth, height + 0.015)],
    )


def kettle(draw: Sampler) -> Model:
    """A kettle: round belly, spout in front, arched handle or a grip behind, a knob on the lid."""
    radius, height = draw.sizes((0.095, 0.12), (0.19, 0.26))
    skin = draw.enamel() if draw.chance(0.6) else draw.metal()
    dark, waist = draw.dark(), draw.uniform(0.55, 0.85)
    profile = [
        (radius * 0.95, 0.0),
        (radius, height * 0.1),
        (radius * draw.uniform(0.9, 1.05), height * 0.5),
        (radius * waist, height * 0.85),
        (radius * waist * 0.8, height * 0.92),
        (0.03, height),
    ]
    spout = rod((radius * 0.75, 0, height * 0.45), (radius * 1.65, 0, height * 0.88), 0.024)
    grip = [lathe([(0.012, 0), (0.022, 0.02), (0.015, 0.035)], (0, 0, height), 8)]
    if draw.chance(0.5):
        angle = np.linspace(0, np.pi, 9)
        arch = [(radius * 0.85 * np.cos(a), 0.0, height * 0.8 + 0.13 * np.sin(a)) for a in angle]
        grip.append(tube(arch, 0.013))
    else:
        x = -radius * 0.8
        points = [(x, 0, height * 0.9), (x - 0.09, 0, height * 0.95), (x - 0.1, 0, height * 0.4)]
        grip.append(tube([*points, (x, 0, height * 0.2)], 0.014))
    if draw.chance(0.5):
        grip.append(cylinder(radius * 1.05, 0.02, segments=16))
    body = [lathe(profile, segments=16), spout]
    return assemble("kettle", (skin, body), (dark if draw.chance(0.7) else skin, grip))


def toaster(draw: Sampler) -> Model:
    """A rounded box with two slots on top, toast in them at times, a lever at one end."""
    width, depth, height = draw.sizes((0.28, 0.36), (0.16, 0.2), (0.18, 0.22))
    skin, dark, slots = draw.enamel(), draw.dark(), (-depth * 0.2, depth * 0.2)
    body = [rounded_box((width, depth, height), (0, 0, 0.015), 0.045)]
    trim = [
        *(box((width * 0.7, 0.03, 0.012), (0, y, height + 0.008)) for y in slots),
        box((width * 0.95, depth * 0.95, 0.03)),
        box((0.03, 0.05, 0.022), (width / 2 + 0.01, 0, height * 0.65)),  # the lever
        knob(0.022, 0.02, (width / 2, 0, height * 0.3), axis="y"),
    ]
    groups = [(skin, body), (dark, trim)]
    if draw.chance(0.6):
        crust = draw.material("noise", 0.2, (0.78, 0.55, 0.28), (0.5, 0.3, 0.12))
        size = (width * 0.4, 0.022, 0.11)
        groups.append((crust, [rounded_box(size, (0, y, height - 0.03), 0.01) for y in slots]))
    return assemble("toaster", *groups)


def bottle(draw: Sampler) -> Model:
    """A tall body, a shoulder, a thin neck with a cap, and a label."""
    height, radius = draw.sizes((0.28, 0.36), (0.04, 0.055))
    shoulder, neck = height * draw.uniform(0.5, 0.68), radius * draw.uniform(0.3, 0.42)
    profile = [(radius * 0.9, 0), (radius, 0.01), (radius, shoulder), (neck, height * 0.78)]
    body = lathe([*profile, (neck, height * 0.93)], segments=14)
    cap = cylinder(neck * 1.2, height * 0.08, (0, 0, height * 0.92), 10)
    label = cylinder(radius * 1.015, shoulder * 0.5, (0, 0, shoulder * 0.25), 14)
    groups = (draw.plastic(), [body]), (draw.plastic(), [cap]), (draw.fabric(), [label])
    return assemble("bottle", *groups)


def cup(draw: Sampler) -> Model:
    """A mug with a handle, generously sized, at times on a saucer."""
    height, radius = draw.sizes((0.11, 0.14), (0.05, 0.065))
    foot, lift = radius * draw.uniform(0.65, 1.0), 0.014 if draw.chance(0.4) else 0.0
    wall = [(foot, 0), (radius, height), (radius * 0.88, height), (foot * 0.85, 0.015), (0, 0.015)]
    loop = [
        (radius * 0.85 + height * 0.35 * np.cos(a), 0.0, height * (0.5 + 0.32 * np.sin(a)))
        for a in np.linspace(-np.pi / 2, np.pi / 2, 7)
    ]
    meshes = [lathe(wall, (0, 0, lift)), tube(loop, 0.011).translated(0, 0, lift)]
    if lift:
        meshes.append(lathe([(radius * 0.8, 0), (radius * 1.7, 0.018), (radius * 0.8, 0.012)]))
    coffee = cylinder(radius * 0.8, 0.005, (0, 0, lift + height * 0.8), 12)
    glaze = draw.plastic() if draw.chance(0.6) else draw.fabric()
    brown = draw.material("plain", 0.5, (0.25, 0.14, 0.08))
    return assemble("cup", (glaze, meshes), (brown, [coffee]))


def bowl(draw: Sampler) -> Model:
    """A wide open bowl, empty or with fruit."""
    radius, height = draw.sizes((0.13, 0.18), (0.08, 0.11))
    foot = radius * 0.45
    profile = [(foot, 0), (foot, 0.012), (radius * 0.8, height * 0.5), (radius, height)]
    profile += [(radius * 0.94, height), (radius * 0.72, height * 0.5), (0.0, 0.025)]
    groups = [(draw.ceramic() if draw.chance(0.4) else draw.wood(), [lathe(profile)])]
    if draw.chance(0.55):
        fruit: list[list[Mesh]] = [[], []]
        for index in range(draw.integer(3, 6)):
            angle, size = index * 1.25, draw.uniform(0.038, 0.048)
            at = (radius * 0.45 * np.cos(angle), radius * 0.45 * np.sin(angle), height * 0.8)
            fruit[index % 2].append(ellipsoid((size, size, size), at, 8))
        groups += [(draw.plastic(), pieces) for pieces in fruit]
    return assemble("bowl", *groups)


def book(draw: Sampler) -> Model:
    """A pile of two to five books, each with covers, a spine and paper edges."""
    z, pages, groups = 0.0, [], []
    for _ in range(draw.integer(2, 5)):
        width, depth, thick = draw.sizes((0.2, 0.27), (0.15, 0.2), (0.03, 0.055))
        x, y, turn = width / 2, depth / 2, draw.uniform(-15, 15)
        covers = [
            box((width, depth, 0.006)),
            box((width, depth, 0.006), (0, 0, thick - 0.006)),
            box_between((-x, -y, 0.0), (x, -y + 0.008, thick)),
        ]
        block = box_between((-x + 0.006, -y, 0.006), (x - 0.006, y - 0.008, thick - 0.006))
        pages.append(block.rotated("z", turn).translated(0, 0, z))
        cover = draw.plastic() if draw.chance(0.7) else draw.fabric()
        groups.append((cover, [mesh.rotated("z", turn).translated(0, 0, z) for mesh in covers]))
        z += thick
    return assemble("book", (draw.material("stripes", 0.02, (0.93, 0.9, 0.8)), pages), *groups)
