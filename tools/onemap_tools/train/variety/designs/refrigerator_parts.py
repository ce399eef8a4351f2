"""Parts that refrigerators share: body, doors, hinges, dispenser, shelves with food."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box, rounded_box
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import feet, provisions, slats

CATEGORY = "refrigerator"
Size = tuple[float, float, float]
Group = tuple[Material, list[Mesh]]


def closed_body(
    sampler: Sampler, size: Size, door: float, low: float
) -> tuple[list[Mesh], list[Mesh]]:
    """The casing behind doors ``door`` thick, and its dark parts: gasket, plinth or feet."""
    width, depth, height = size
    deep = depth - door - 0.012
    y = depth / 2 - deep / 2
    casing = [box((width, deep, height - low), (0, y, low))]
    dark = [box((width - 0.03, 0.03, height - low - 0.03), (0, -depth / 2 + door, low + 0.015))]
    if sampler.chance(0.6):
        dark.append(box((width - 0.03, deep - 0.04, low - 0.012), (0, y + 0.01, 0.012)))
        front = -depth / 2 + door + 0.02
        dark += slats(width - 0.05, low - 0.02, (0, front, 0.012), 4)
    dark += [m.translated(0, y) for m in feet(width, deep, low + 0.002)]
    return casing, dark


def hinge_covers(width: float, depth: float, height: float, sides: tuple[int, ...]) -> list[Mesh]:
    """Hinge covers on the top, over the front corners."""
    return [
        box((0.05, 0.1, 0.018), (side * (width / 2 - 0.04), -depth / 2 + 0.06, height))
        for side in sides
    ]


def door_leaf(sampler: Sampler, size: Size, at: Size) -> Mesh:
    """One door: ``at`` is the middle of the lower edge of its front."""
    radius = sampler.choice([0.004, 0.012, 0.025])
    return rounded_box(size, (at[0], at[1] + size[1] / 2, at[2]), radius)


def dispenser(sampler: Sampler, at: Size) -> tuple[list[Mesh], list[Mesh]]:
    """Frame, and dark recess with screen, for water and ice in a door with its front at y."""
    x, y, z = at
    wide, tall = sampler.uniform(0.16, 0.22), sampler.uniform(0.28, 0.4)
    rim = 0.014
    frame = [box((wide, 0.022, rim), (x, y - 0.002, z + h)) for h in (0, tall - rim, tall * 0.68)]
    for side in (-1, 1):
        frame.append(box((rim, 0.022, tall), (x + side * (wide - rim) / 2, y - 0.004, z)))
    frame.append(box((wide * 0.7, 0.04, 0.012), (x, y - 0.008, z + 0.018)))
    frame.append(box((0.04, 0.03, 0.07), (x, y - 0.008, z + tall * 0.45)))
    return frame, [box((wide - 0.01, 0.012, tall - 0.01), (x, y - 0.002, z + 0.005))]


def stocked_shelves(
    sampler: Sampler, width: float, depth: float, span: tuple[float, float]
) -> tuple[list[Mesh], list[Group]]:
    """Shelves across a cavity about x = y = 0 between heights, with drawers below and food."""
    low, high = span
    shelves: list[Mesh] = []
    drawers: list[Mesh] = []
    food: list[list[Mesh]] = [[], []]
    count = max(2, round((high - low) / sampler.uniform(0.22, 0.34)))
    pitch = (high - low) / count
    for row in range(count):
        z = low + row * pitch
        if row:
            shelves.append(box((width, depth, 0.012), (0, 0, z)))
            shelves.append(box((width, 0.012, 0.022), (0, -depth / 2, z - 0.005)))
        if row == 0 and sampler.chance(0.75):
            for side in (-1, 1):
                size = (width / 2 - 0.015, depth - 0.04, min(pitch * 0.8, 0.2))
                drawers.append(rounded_box(size, (side * width / 4, 0, z + 0.006), 0.012))
        elif sampler.chance(0.85):
            at = (0.0, -depth * 0.1, z + 0.013)
            food[row % 2] += provisions(sampler, width, depth, pitch * 0.85, at)
    groups = [(sampler.plastic(), food[0]), (sampler.fabric(), food[1]), (sampler.pale(), drawers)]
    return shelves, [group for group in groups if group[1]]


def door_frame(
    width: float, tall: float, at: tuple[float, float, float], rail: float
) -> list[Mesh]:
    """Four rails round an opening: ``at`` is the middle of the lower edge of the front."""
    x, y, z = at
    meshes = [box((width, 0.04, rail), (x, y + 0.02, z + h)) for h in (0, tall - rail)]
    for side in (-1, 1):
        upright = box(
            (rail, 0.04, tall - 2 * rail), (x + side * (width - rail) / 2, y + 0.02, z + rail)
        )
        meshes.append(upright)
    return meshes
