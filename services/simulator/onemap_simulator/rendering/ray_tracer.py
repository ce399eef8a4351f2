"""Ray casting against a scene's triangles, by Embree on the calling thread.

Embree releases the interpreter lock while it traces, so other threads run meanwhile.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from onemap_shared.geometry import F32, I32, Bool
from onemap_simulator.scene.scene import Scene

SHADOW_MARGIN = 0.01  # share of a segment ignored at both ends, so that no surface occludes itself


@dataclass(frozen=True, slots=True)
class RayHits:
    """The first intersections of N rays.

    face (N,) int32, -1 = nothing; distance (N,) float32 in lengths of the ray's direction,
    0 where nothing was hit; u, v (N,) float32 barycentric weights of the face's second and
    third corner.
    """

    face: I32
    distance: F32
    u: F32
    v: F32


class RayTracer:
    """The acceleration structure of one scene; one thread at a time may use it."""

    def __init__(self, scene: Scene) -> None:
        self._scene = EmbreeScene(robust=True)  # no ray slips through between two triangles
        self._mesh = TriangleMesh(
            self._scene,
            np.ascontiguousarray(scene.vertices, np.float32),
            np.ascontiguousarray(scene.faces, np.int32),
        )

    def first_hits(self, origins: F32, directions: F32) -> RayHits:
        """First intersections of rays from origins (N, 3) metres along directions (N, 3)."""
        origins, directions = _rows(origins), _rows(directions)
        hit = self._scene.run(origins, directions, output=True)
        face = hit["primID"]
        distance = np.where(face >= 0, hit["tfar"], np.float32(0))
        return RayHits(face, distance, hit["u"], hit["v"])

    def hits_of(self, origin: F32, directions: F32) -> RayHits:
        """First intersections of rays from one origin (3,) metres along directions (N, 3)."""
        return self.first_hits(np.broadcast_to(origin, directions.shape), directions)

    def occluded(self, starts: F32, ends: F32) -> Bool:
        """Whether (N,) the segments from points (N, 3) to points (N, 3) metres are blocked."""
        along = ends - starts
        hit = self._scene.run(
            _rows(starts + SHADOW_MARGIN * along),
            _rows(along),
            dists=1.0 - 2 * SHADOW_MARGIN,
            query="OCCLUDED",
        )
        blocked: Bool = hit != -1
        return blocked


def _rows(array: F32) -> F32:
    """The form Embree reads: contiguous float32."""
    return np.ascontiguousarray(array, np.float32)
