"""What a real depth camera does at edges, on glass and on black surfaces, and its steps."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, I32, Bool
from onemap_simulator.errors import DepthErrorParams
from onemap_simulator.scene.scene import Scene

GLASS = frozenset({"window", "mirror"})  # categories whose surfaces send the light elsewhere
NEIGHBOURS = np.ones((3, 3), np.uint8)


def faces_without_return(scene: Scene, params: DepthErrorParams) -> Bool:
    """Whether (F + 1,) each face gives no depth; the last row is for rays that hit nothing."""
    means = np.array([texture.mean() for texture in scene.textures])
    without = means[scene.face_texture] < params.dark_below
    if params.glass:
        glass = np.array([thing.category in GLASS for thing in scene.objects], bool)
        without |= glass[scene.face_object]
    return np.append(without, False)


def with_depth_errors(
    depth_m: F32,
    faces: I32,
    without_return: Bool,
    params: DepthErrorParams,
    rng: np.random.Generator,
) -> F32:
    """Depth (H, W) float32 in metres with errors; 0 is no return.

    faces (H, W): the face each pixel shows, -1 for none; without_return (F + 1,).
    """
    measured = _with_edges(depth_m, params, rng)
    measured = np.where(without_return[faces], np.float32(0), measured)
    return quantised(measured, params.step_m) if params.step_m > 0 else measured


def depth_edges(depth_m: F32, edge_jump: float) -> Bool:
    """Pixels (H, W) at which depth jumps, by more than this share of it, or ends.

    The inverse depth of a plane is linear over the image, so that its second differences vanish
    on planes, however slanted.
    """
    inverse = 1.0 / np.where(depth_m > 0, depth_m, np.float32(np.inf))
    padded = np.pad(inverse, 1, mode="reflect", reflect_type="odd")
    rows = padded[2:, 1:-1] + padded[:-2, 1:-1] - 2 * inverse
    columns = padded[1:-1, 2:] + padded[1:-1, :-2] - 2 * inverse
    bend = np.maximum(np.abs(rows), np.abs(columns))
    edges: Bool = (bend > edge_jump * inverse) & (depth_m > 0)
    return edges


def quantised(depth_m: F32, step_m: float) -> F32:
    """Depth in steps of ``step_m`` times its square: evenly spaced in disparity, 1 / depth."""
    disparity = np.rint(1.0 / (step_m * np.maximum(depth_m, np.float32(1e-3))))
    steps: F32 = np.where(depth_m > 0, 1.0 / (step_m * np.maximum(disparity, 1.0)), 0.0).astype(
        np.float32
    )
    return steps


def _with_edges(depth_m: F32, params: DepthErrorParams, rng: np.random.Generator) -> F32:
    if not (params.edge_flying or params.edge_holes):
        return depth_m
    edges = depth_edges(depth_m, params.edge_jump)
    count = int(edges.sum())
    chance, between = rng.random((2, count), np.float32)
    near = cv2.erode(depth_m, NEIGHBOURS)[edges]
    far = cv2.dilate(depth_m, NEIGHBOURS)[edges]
    flying = chance < params.edge_flying
    holes = ~flying & (chance < params.edge_flying + params.edge_holes)
    at_edges = np.where(flying, near + between * (far - near), depth_m[edges])
    measured: F32 = depth_m.copy()
    measured[edges] = np.where(holes, np.float32(0), at_edges)
    return measured
