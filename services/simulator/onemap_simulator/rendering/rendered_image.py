"""What a renderer returns."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_shared.geometry import F32, I32, U8


@dataclass(frozen=True, slots=True)
class RenderedImage:
    """One rendered image.

    rgb (H, W, 3) uint8; depth_m (H, W) float32 along the optical axis, 0 = nothing hit;
    labels (H, W) int32 index into the scene's objects, faces (H, W) int32 into its triangles,
    -1 = nothing hit.
    """

    rgb: U8
    depth_m: F32
    labels: I32
    faces: I32
