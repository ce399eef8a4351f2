"""Kitchen appliances and cabinets that stand in a row, 0.6 m deep."""

from __future__ import annotations

import numpy as np

from onemap_simulator.furniture.storage import handle_bar
from onemap_simulator.mesh import Mesh, box, cylinder, lathe, ring, rod, soft_box, span, tube
from onemap_simulator.model import Material, Model, Top, assemble, top_of
from onemap_simulator.pick import Pick

DEPTH_M = 0.6
COUNTER_M = 0.9
FRONT_Y = -DEPTH_M / 2


def kitchen_cabinet(pick: Pick, width: float, look: tuple[Material, Material, Material]) -> Model:
    """A base cabinet with doors or drawers under a worktop; look: body, worktop, handles."""
    body, worktop, metal = look
    meshes = [box((width, DEPTH_M - 0.03, COUNTER_M - 0.14), (0, 0.015, 0.1))]
    meshes.append(box((width, DEPTH_M - 0.1, 0.1), (0, 0.03, 0)))
    leaves, handles = _fronts(pick, width, (0.11, COUNTER_M - 0.05), FRONT_Y)
    board = box((width, DEPTH_M + 0.02, 0.04), (0, 0, COUNTER_M - 0.04))
    return assemble(
        "kitchen cabinet",
        (body, [*meshes, *leaves]),
        (worktop, [board]),
        (metal, handles),
        tops=(Top(-width / 2 + 0.03, -0.2, width / 2 - 0.03, 0.26, COUNTER_M),),
    )


def wall_cabinet(pick: Pick, width: float, look: tuple[Material, Material, Material]) -> Model:
    """A shallow cabinet to hang above a worktop; z = 0 is its underside."""
    height, depth = 0.62, 0.34
    leaves, handles = _fronts(pick, width, (0.01, height - 0.01), -depth / 2, doors_only=True)
    body = box((width, depth - 0.03, height), (0, 0.015, 0))
    return assemble("kitchen cabinet", (look[0], [body, *leaves]), (look[2], handles))


def _fronts(
    pick: Pick, width: float, z: tuple[float, float], y: float, *, doors_only: bool = False
) -> tuple[list[Mesh], list[Mesh]]:
    low, high = z
    leaves, handles = [], []
    if not doors_only and pick.chance(0.4):
        count = pick.count(3, 4)
        tall = (high - low) / count
        for row in range(count):
            at = (0.0, y + 0.012, low + row * tall)
            leaves.append(soft_box((width - 0.012, 0.03, tall - 0.012), at, 0.006))
            handles.append(handle_bar(pick, width * 0.45, (0, y, low + (row + 0.75) * tall), False))
        return leaves, handles
    count = 2 if width > 0.65 else 1
    each = width / count
    for index in range(count):
        x = (index - (count - 1) / 2) * each
        leaves.append(soft_box((each - 0.012, 0.03, high - low), (x, y + 0.012, low), 0.006))
        side = 1 if index == 0 else -1
        at = (x + side * (each / 2 - 0.06), y, low + 0.16 if doors_only else high - 0.16)
        handles.append(handle_bar(pick, 0.16, at, True))
    return leaves, handles


def oven(pick: Pick) -> Model:
    """A cooker: hob with four rings on top, knobs, a door with a dark window and a handle bar."""
    width = pick.size(0.56, 0.62)
    casing, dark, metal = pick.enamel(), pick.dark(), pick.metal()
    y, top = FRONT_Y, COUNTER_M
    body = [box((width, DEPTH_M - 0.04, top - 0.03), (0, 0.02, 0))]
    door_low, door_high = pick.size(0.16, 0.24), 0.72
    body.append(
        soft_box((width - 0.03, 0.05, door_high - door_low), (0, y + 0.025, door_low), 0.01)
    )
    plate = [box((width, DEPTH_M, 0.03), (0, 0, top - 0.03))]
    glass = [
        box((width * 0.68, 0.01, (door_high - door_low) * 0.55), (0, y - 0.004, door_low + 0.09))
    ]
    hob, knobs = [], []
    for x in (-0.14, 0.14):
        for depth in (-0.13, 0.13):
            radius = pick.between(0.07, 0.1)
            hob.append(cylinder(radius, 0.018, (x, depth, top), 16))
            knobs.append(ring(radius * 0.7, 0.008, (x, depth, top + 0.02), 14))
    for x in np.linspace(-width * 0.36, width * 0.36, pick.count(4, 6)):
        knob = cylinder(0.022, 0.035, segments=10).turned("x", 90)
        knobs.append(knob.moved(float(x), y + 0.02, 0.8))
    bar = [handle_bar(pick, width * 0.8, (0, y - 0.02, door_high - 0.06), False)]
    if pick.chance(0.4):
        body.append(box((width, 0.03, 0.14), (0, DEPTH_M / 2 - 0.015, top)))
    return assemble(
        "oven",
        (casing, body),
        (dark if pick.chance(0.6) else pick.metal(), plate),
        (dark, [*glass, *hob]),
        (metal, [*bar, *knobs]),
    )


def dishwasher(pick: Pick, worktop: Material) -> Model:
    """A flush front with a control strip, a long handle and a plinth, under a worktop."""
    width = pick.size(0.56, 0.61)
    y = FRONT_Y
    casing, dark, metal = pick.enamel(), pick.dark(), pick.metal()
    body = [box((width, DEPTH_M - 0.04, 0.84), (0, 0.02, 0.02))]
    door = [soft_box((width - 0.015, 0.04, 0.6), (0, y + 0.02, 0.12), 0.008)]
    strip = [box((width - 0.015, 0.04, 0.11), (0, y + 0.02, 0.74))]
    lamps = [box((0.02, 0.01, 0.012), (x, y - 0.003, 0.79)) for x in (0.08, 0.12, 0.16, 0.2)]
    screen = [box((0.1, 0.01, 0.04), (-0.15, y - 0.003, 0.775)), box((width, 0.5, 0.1), (0, 0, 0))]
    bar = [handle_bar(pick, width * 0.85, (0, y - 0.015, 0.69), False)]
    board = box((width, DEPTH_M + 0.02, 0.04), (0, 0, COUNTER_M - 0.04))
    second = dark if pick.chance(0.5) else pick.metal()
    return assemble(
        "dishwasher",
        (casing, [*body, *door]),
        (second, strip),
        (pick.pale(), lamps),
        (dark, screen),
        (metal, bar),
        (worktop, [board]),
        tops=(Top(-width / 2 + 0.03, -0.2, width / 2 - 0.03, 0.26, COUNTER_M),),
    )


def refrigerator(pick: Pick) -> Model:
    """A tall box split into two doors, above each other or side by side, with long handles."""
    width, depth, height = pick.size(0.58, 0.72), pick.size(0.6, 0.68), pick.size(1.6, 1.95)
    casing, metal = pick.enamel(), pick.metal()
    y = -depth / 2
    body = [box((width, depth - 0.07, height - 0.05), (0, 0.035, 0.05))]
    leaves, handles = [], []
    if width > 0.66 and pick.chance(0.5):
        for side in (-1, 1):
            size = (width / 2 - 0.01, 0.07, height - 0.06)
            leaves.append(soft_box(size, (side * width / 4, y + 0.035, 0.06), 0.015))
            at = (side * 0.05, y - 0.01, height * 0.55)
            handles.append(handle_bar(pick, height * 0.4, at, True))
    else:
        split = height * pick.one([0.35, 0.62, 0.68])
        side = pick.one([-1, 1])
        for low, high in ((0.06, split - 0.008), (split + 0.008, height)):
            leaves.append(soft_box((width, 0.07, high - low), (0, y + 0.035, low), 0.02))
            near = low + 0.26 if high > height - 0.01 else high - 0.26
            handles.append(
                handle_bar(pick, 0.32, (side * (width / 2 - 0.06), y - 0.01, near), True)
            )
    gasket = box((width - 0.02, depth - 0.1, height - 0.07), (0, 0.02, 0.06))
    feet = box((width - 0.06, depth - 0.12, 0.06), (0, 0, 0))
    return assemble(
        "refrigerator", (casing, [*body, *leaves]), (metal, handles), (pick.dark(), [gasket, feet])
    )


def microwave(pick: Pick) -> Model:
    """A box with a dark window on the left, a keypad on the right and a handle between."""
    width, depth, height = pick.size(0.46, 0.54), pick.size(0.32, 0.38), pick.size(0.27, 0.32)
    y, pad = -depth / 2, width * 0.24
    casing, dark = pick.enamel(), pick.dark()
    body = [soft_box((width, depth, height), (0, 0, 0.015), 0.015)]
    window = [box((width - pad - 0.06, 0.012, height - 0.08), (-pad / 2 - 0.005, y, 0.055))]
    keypad = [box((pad - 0.03, 0.012, height - 0.06), (width / 2 - pad / 2, y, 0.045))]
    keys = [
        box((0.018, 0.012, 0.014), (width / 2 - pad / 2 + dx, y - 0.006, 0.07 + row * 0.032))
        for dx in (-0.028, 0.0, 0.028)
        for row in range(4)
    ]
    screen = box((pad * 0.6, 0.012, 0.03), (width / 2 - pad / 2, y - 0.006, height - 0.06))
    bar = handle_bar(pick, height * 0.75, (width / 2 - pad - 0.012, y, height / 2 + 0.015), True)
    grey = pick.of("plain", 0.5, pick.grey(0.2, 0.5))
    return assemble(
        "microwave",
        (casing, body),
        (dark, window),
        (grey, keypad),
        (pick.pale(), [*keys, screen]),
        (pick.metal(), [bar]),
        tops=(top_of(width, depth, height + 0.015),),
    )


def kettle(pick: Pick) -> Model:
    """A kettle: round belly, spout in front, arched handle or a grip behind, a knob on the lid."""
    radius, height = pick.size(0.095, 0.12), pick.size(0.19, 0.26)
    skin = pick.enamel() if pick.chance(0.6) else pick.metal()
    dark = pick.dark()
    waist = pick.between(0.55, 0.85)
    profile = [
        (radius * 0.95, 0.0),
        (radius, height * 0.1),
        (radius * pick.between(0.9, 1.05), height * 0.5),
        (radius * waist, height * 0.85),
        (radius * waist * 0.8, height * 0.92),
        (0.03, height),
    ]
    body = [lathe(profile, segments=16)]
    spout = rod((radius * 0.75, 0, height * 0.45), (radius * 1.65, 0, height * 0.88), 0.024)
    grip: list[Mesh] = [lathe([(0.012, 0), (0.022, 0.02), (0.015, 0.035)], (0, 0, height), 8)]
    if pick.chance(0.5):
        angle = np.linspace(0, np.pi, 9)
        arch = [(radius * 0.85 * np.cos(a), 0.0, height * 0.8 + 0.13 * np.sin(a)) for a in angle]
        grip.append(tube(arch, 0.013))
    else:
        x = -radius * 0.8
        points = [(x, 0, height * 0.9), (x - 0.09, 0, height * 0.95), (x - 0.1, 0, height * 0.4)]
        grip.append(tube([*points, (x, 0, height * 0.2)], 0.014))
    if pick.chance(0.5):
        grip.append(cylinder(radius * 1.05, 0.02, (0, 0, -0.0), 16))
    return assemble("kettle", (skin, [*body, spout]), (dark if pick.chance(0.7) else skin, grip))


def toaster(pick: Pick) -> Model:
    """A rounded box with two slots on top, toast in them at times, a lever at one end."""
    width, depth, height = pick.size(0.28, 0.36), pick.size(0.16, 0.2), pick.size(0.18, 0.22)
    skin, dark = pick.enamel(), pick.dark()
    body = [soft_box((width, depth, height), (0, 0, 0.015), 0.045)]
    slots = [
        box((width * 0.7, 0.03, 0.012), (0, side * depth * 0.2, height + 0.008)) for side in (-1, 1)
    ]
    base = box((width * 0.95, depth * 0.95, 0.03))
    lever = box((0.03, 0.05, 0.022), (width / 2 + 0.01, 0, height * 0.65))
    dial = cylinder(0.022, 0.02, segments=10).turned("y", 90).moved(width / 2, 0, height * 0.3)
    groups = [(skin, body), (dark, [*slots, base, lever, dial])]
    if pick.chance(0.6):
        crust = pick.of("noise", 0.2, (0.78, 0.55, 0.28), (0.5, 0.3, 0.12))
        slices = [
            soft_box((width * 0.4, 0.022, 0.11), (0, side * depth * 0.2, height - 0.03), 0.01)
            for side in (-1, 1)
        ]
        groups.append((crust, slices))
    return assemble("toaster", *groups)


def kitchen_sink(pick: Pick, width: float, look: tuple[Material, Material, Material]) -> Model:
    """A basin with an apron front, set in the worktop's row, with an arched tap."""
    basin = pick.ceramic() if pick.chance(0.5) else pick.of("brushed", 0.5, pick.grey(0.6, 0.85))
    wall, low, high = 0.035, COUNTER_M - 0.24, COUNTER_M + 0.02
    y0, y1, x = FRONT_Y - 0.02, DEPTH_M / 2, width / 2
    meshes = [
        span((-x, y0, low), (x, y1, low + 0.05)),
        span((-x, y0, low), (x, y0 + wall, high)),
        span((-x, y1 - 0.14, low), (x, y1, high)),
        span((-x, y0, low), (-x + wall, y1, high)),
        span((x - wall, y0, low), (x, y1, high)),
    ]
    cabinet = span((-x, FRONT_Y + 0.02, 0.0), (x, y1, low))
    leaves, handles = _fronts(pick, width, (0.1, low - 0.01), FRONT_Y, doors_only=True)
    drain = cylinder(0.035, 0.01, (0, 0, low + 0.05), 12)
    return assemble(
        "sink",
        (basin, meshes),
        (look[0], [cabinet, *leaves]),
        (look[2], handles),
        (pick.metal(), [*tap(pick, (0, y1 - 0.07, high)), drain]),
    )


def tap(pick: Pick, at: tuple[float, float, float]) -> list[Mesh]:
    """An arched or angular tap that reaches towards -y, with two handles."""
    reach, rise = pick.size(0.15, 0.2), pick.size(0.18, 0.28)
    if pick.chance(0.6):
        angle = np.linspace(0, np.pi, 8)
        arch = [(0.0, -reach / 2 * (1 - np.cos(a)), rise * 0.6 + 0.1 * np.sin(a)) for a in angle]
        meshes = [tube([(0, 0, 0), (0, 0, rise * 0.3), *arch], 0.014)]
    else:
        meshes = [rod((0, 0, 0), (0, 0, rise * 0.7), 0.018)]
        meshes.append(rod((0, 0.015, rise * 0.68), (0, -reach, rise * 0.68), 0.014))
    for side in (-1, 1):
        meshes.append(cylinder(0.018, 0.06, (side * 0.09, 0, 0), 8))
        meshes.append(box((0.06, 0.014, 0.014), (side * 0.09, 0, 0.055)))
    return [mesh.moved(*at) for mesh in meshes]
