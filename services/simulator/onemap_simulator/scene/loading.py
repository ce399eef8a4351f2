"""Make a scene from a user's file: axes, floor, categories, textures, start and lamps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from onemap_shared.geometry import F32, F64, U8
from onemap_shared.grid import GridSpec
from onemap_simulator.scene.cell_masks import clearance_m, dilated, largest_part
from onemap_simulator.scene.occupancy_raster import occupied_cells
from onemap_simulator.scene.scene import UNNAMED, PointLight, Scene, SceneObject
from onemap_simulator.scene.scene_file import SceneFile, missing_node, read_scene_file

AMBIENT = (0.6, 0.6, 0.6)  # bright: unknown rooms may have no place for a lamp
FLOOR_SEARCH_M = 1.0  # the floor lies within this height of the lowest point
FLOOR_BIN_M = 0.02
MAX_WIDTH_M = 200.0  # wider is not in metres, and its floor grid would not fit in memory
MIN_WIDTH_M = 1.0  # narrower is probably not in metres
MAX_LISTED = 5  # names listed in a warning

MAX_TEXTURE_PX = 1024  # larger images are shrunk: no detail of a 640 x 480 frame is lost
COLOUR_STEP = 8  # colours per vertex are rounded to this many levels of 255
PLAIN_GREY = (180, 180, 180)
CELL_SIZE_M = 0.05
ROBOT_CLEARANCE_M = 0.3  # from any obstacle: a robot of 0.25 m radius and a cell
BODY_HEIGHTS_M = (0.05, 1.4)  # geometry between these heights is an obstacle
FLOOR_HEIGHTS_M = (-0.05, 0.05)  # geometry between these heights is floor
LAMP_HEIGHT_M = 2.1
LAMP_SPACING_M = 3.5
MAX_LAMPS = 8
LAMP = (0.8, 0.8, 0.78)

# Rotation from glTF's axes (y up) to the map's (z up).
Z_FROM_Y_UP: F64 = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def load_scene(path: Path | str) -> Scene:
    """The scene in a file, in metres with z up.

    glTF is turned from y-up; OBJ and PLY are taken as z-up unless the YAML says ``up: y``.
    Everything is shifted vertically so that the floor lies at z = 0: the level within the
    lowest metre with the largest horizontal area, else the lowest point; the YAML's ``floor``
    names it in a scene with a storey below. Node names become
    categories (see ``scene_file``), PLY is one "object"; the YAML's ``categories`` rename nodes.
    Without a ``start`` the robot starts where the largest free floor has most clearance.
    ValueError: a missing, unreadable, empty or unsupported file, one that is wider than 200 m,
    or a wrong YAML.
    """
    file = read_scene_file(Path(path))
    if file.unknown_nodes:
        raise ValueError(missing_node(file))
    scene = assemble(file)
    if problem := size_problem(scene):
        raise ValueError(f"scene {path} {problem}")
    grid, clearance, has_floor = free_space(scene)
    start = file.corrections.start or start_pose(grid, clearance)
    if start is None:
        raise ValueError(
            f"scene {path} has no free floor for a robot: give 'start: [x, y, yaw]' in "
            f"{file.yaml.name}"
        )
    warnings = tuple(_warnings(file, scene, has_floor=has_floor))
    return replace(scene, start=start, lights=ceiling_lamps(grid, clearance), warnings=warnings)


def _warnings(file: SceneFile, scene: Scene, *, has_floor: bool) -> Iterator[str]:
    unnamed = sorted(n.name for n in file.nodes if file.category(n.name) == UNNAMED)
    if unnamed:
        more = ", ..." if len(unnamed) > MAX_LISTED else ""
        yield (
            f"{len(unnamed)} of {len(file.nodes)} nodes have no name that says what they are "
            f"({', '.join(unnamed[:MAX_LISTED])}{more}): a search for them has no ground truth. "
            f"Name them under 'categories' in {file.yaml.name}."
        )
    width_m = float(np.ptp(scene.vertices[:, :2], axis=0).max())
    if width_m < MIN_WIDTH_M:
        yield f"The scene is only {width_m:.2g} m wide: is its unit the metre?"
    if not has_floor:
        yield (
            "No floor was found at height 0: the robot is taken to drive on a plane. If that is "
            "wrong, look whether the up axis is right."
        )


def size_problem(scene: Scene) -> str:
    """Why a scene cannot be in metres, by its width; empty if it can."""
    width_m = float(np.ptp(scene.vertices[:, :2], axis=0).max())
    if width_m <= MAX_WIDTH_M:
        return ""
    unit, factor = ("centimetres", 0.01) if width_m <= 2500 else ("millimetres", 0.001)
    return (
        f"is {width_m:.0f} m wide, more than {MAX_WIDTH_M:.0f} m: its unit looks like {unit}; "
        f"export it in metres, that is scaled by {factor:g}"
    )


def assemble(file: SceneFile) -> Scene:
    """The scene without lights and start, floor at z = 0."""
    name = file.path.stem
    R = Z_FROM_Y_UP if file.up == "y" else np.eye(3)
    meshes = [mesh for node in file.nodes for mesh in node.meshes]
    vertices = [np.asarray(mesh.vertices, dtype=np.float64) @ R.T for mesh in meshes]
    offsets = np.cumsum([0, *(len(v) for v in vertices[:-1])])
    faces = np.concatenate([mesh.faces + at for mesh, at in zip(meshes, offsets, strict=True)])
    owners = np.repeat(np.arange(len(file.nodes)), [node.triangles for node in file.nodes])
    materials = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    looks = [_texture_and_uv(mesh) for mesh in meshes]
    points = np.concatenate(vertices)
    if not np.isfinite(points).all():
        raise ValueError(f"scene {name} has vertices that are NaN or infinite")
    given = file.corrections.floor_m
    floor_m = floor_height(points, faces) if given is None else given
    points[:, 2] -= floor_m
    return Scene(
        name=name,
        vertices=points.astype(np.float32),
        faces=faces.astype(np.int32),
        face_object=owners.astype(np.int32),
        face_texture=materials.astype(np.int32),
        face_uv=np.concatenate([uv for _, uv in looks]).astype(np.float32),
        textures=tuple(image for image, _ in looks),
        objects=tuple(SceneObject(file.category(node.name)) for node in file.nodes),
        lights=(),
        ambient=AMBIENT,
        rooms=(),
        start=(0.0, 0.0, 0.0),
        names_complete=False,
    )


def floor_height(vertices: F64, faces: np.ndarray) -> float:
    """Height in metres of the floor of a mesh: vertices (V, 3), faces (F, 3).

    The level with the largest horizontal area within FLOOR_SEARCH_M of the lowest point, else
    the lowest point.
    """
    corners = vertices[faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(doubled, axis=1) / 2
    lowest = float(corners[..., 2].min())
    height = corners[..., 2].mean(axis=1)
    level = np.abs(doubled[:, 2]) > 0.98 * 2 * area
    low = level & (area > 0) & (height <= lowest + FLOOR_SEARCH_M)
    if not low.any():
        return lowest
    bins = np.floor((height[low] - lowest) / FLOOR_BIN_M).astype(int)
    areas = np.bincount(bins, weights=area[low])
    # The top and bottom of a slab have equal areas: of nearly equal levels take the highest.
    best = int(np.flatnonzero(areas >= 0.9 * areas.max()).max())
    members = bins == best
    return float(np.average(height[low][members], weights=area[low][members]))


def _texture_and_uv(mesh: Any) -> tuple[U8, F32]:
    """A texture (h, w, 3) uint8 RGB and the corners' uv (F, 3, 2) float32 of a trimesh mesh.

    v = 0 is the image's first row. A texture needs uv; without, its mean colour is used.
    """
    from trimesh.visual import TextureVisuals

    visual = mesh.visual
    if isinstance(visual, TextureVisuals):
        material = visual.material
        image, tint = _image_of(material), _tint_of(material)
        if image is None:
            return _plain(tint, len(mesh.faces))
        tinted = (image * (np.asarray(tint) / 255.0) + 0.5).astype(np.uint8)
        if visual.uv is None or len(visual.uv) != len(mesh.vertices):
            mean = tinted.reshape(-1, 3).mean(axis=0)
            return _plain((int(mean[0]), int(mean[1]), int(mean[2])), len(mesh.faces))
        uv = np.asarray(visual.uv, dtype=np.float32)[mesh.faces]
        uv = np.nan_to_num(uv)
        return tinted, np.stack([uv[..., 0], 1.0 - uv[..., 1]], axis=-1)  # trimesh's v points up
    if visual.kind in ("vertex", "face"):
        return _from_colours(np.asarray(visual.face_colors)[:, :3])
    return _plain(PLAIN_GREY, len(mesh.faces))


def _image_of(material: Any) -> U8 | None:
    image = getattr(material, "baseColorTexture", None)
    if image is None:
        image = getattr(material, "image", None)
    if image is None:
        return None
    pixels = np.asarray(image.convert("RGB"), dtype=np.uint8)
    scale = MAX_TEXTURE_PX / max(pixels.shape[:2])
    if scale < 1.0:
        pixels = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA).astype(
            np.uint8
        )
    return pixels


def _tint_of(material: Any) -> tuple[int, int, int]:
    """The material's base colour, 0 to 255; white for a textured material without one."""
    for name in ("baseColorFactor", "diffuse"):
        colour = getattr(material, name, None)
        if colour is not None and not (name == "diffuse" and _image_of(material) is not None):
            values = np.asarray(colour, dtype=np.float64)[:3]
            if np.issubdtype(np.asarray(colour).dtype, np.floating) and values.max() <= 1.0:
                values = values * 255
            red, green, blue = np.clip(values, 0, 255).astype(int).tolist()
            return (red, green, blue)
    return (255, 255, 255) if _image_of(material) is not None else PLAIN_GREY


def _plain(colour: tuple[int, int, int], faces: int) -> tuple[U8, F32]:
    return np.full((4, 4, 3), colour, np.uint8), np.full((faces, 3, 2), 0.5, np.float32)


def _from_colours(colours: U8) -> tuple[U8, F32]:
    """One texel per distinct colour, rounded; every face (F, 3) lies wholly within its texel."""
    rounded = colours.astype(np.int64) // COLOUR_STEP * COLOUR_STEP + COLOUR_STEP // 2
    palette, index = np.unique(rounded, axis=0, return_inverse=True)
    index = index.reshape(-1)
    side = int(np.ceil(np.sqrt(len(palette))))
    image = np.zeros((side * side, 3), np.uint8)
    image[: len(palette)] = palette
    centre = np.stack([index % side + 0.5, index // side + 0.5], axis=-1) / side
    uv = np.repeat(centre[:, None], 3, axis=1).astype(np.float32)
    return image.reshape(side, side, 3), uv


def free_space(scene: Scene) -> tuple[GridSpec, F32, bool]:
    """The largest connected floor area: clearance (nx, ny) float32 in metres, 0 outside of it.

    Floor is where geometry lies at height 0, unless all of it lies below obstacles. A scene without
    any is taken to have a plane; the last value says whether it has.
    """
    grid, blocked = occupied_cells(scene, CELL_SIZE_M, *BODY_HEIGHTS_M)
    _, floor = occupied_cells(scene, CELL_SIZE_M, *FLOOR_HEIGHTS_M)
    has_floor = bool((floor & ~dilated(blocked)).any())
    clearance = clearance_m(blocked | ~floor if has_floor else blocked, CELL_SIZE_M)
    inside = largest_part(clearance >= ROBOT_CLEARANCE_M)
    return grid, np.where(inside, clearance, np.float32(0.0)), has_floor


def start_pose(grid: GridSpec, clearance: F32) -> tuple[float, float, float] | None:
    """x, y, yaw where the clearance is largest, facing the centre of the free space, or None."""
    if not clearance.any():
        return None
    best = np.array(np.unravel_index(int(clearance.argmax()), clearance.shape))
    x, y = grid.centres(best)
    middle = grid.centres(np.argwhere(clearance > 0)).mean(axis=0)
    return (float(x), float(y), float(np.arctan2(middle[1] - y, middle[0] - x)))


def ceiling_lamps(grid: GridSpec, clearance: F32) -> tuple[PointLight, ...]:
    """Up to MAX_LAMPS lamps over the free space, by farthest point sampling."""
    places: F64 = grid.centres(np.argwhere(clearance > 0))
    if not len(places):
        return ()
    chosen = [places[np.linalg.norm(places - places.mean(axis=0), axis=1).argmin()]]
    away = np.linalg.norm(places - chosen[0], axis=1)
    while len(chosen) < MAX_LAMPS and away.max() > LAMP_SPACING_M:
        chosen.append(places[away.argmax()])
        away = np.minimum(away, np.linalg.norm(places - chosen[-1], axis=1))
    return tuple(PointLight((float(x), float(y), LAMP_HEIGHT_M), LAMP) for x, y in chosen)
