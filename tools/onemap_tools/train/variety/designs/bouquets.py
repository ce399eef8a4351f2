"""What a vase is of and what stands in it: tulips, daisies, twigs, grasses, branches."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, ellipsoid, lathe, rod, tube
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.flat_forms import settled
from onemap_tools.train.variety.designs.plant_parts import LANCE, OVAL, Groups, arch, leaf

Profile = list[tuple[float, float]]


def glaze_of(sampler: Sampler) -> Material:
    """What a vase is made of."""
    kind = sampler.integer(0, 4)
    if kind == 0:
        return sampler.metal()
    if kind == 1:
        return sampler.fabric() if sampler.chance(0.5) else sampler.wood()
    return sampler.ceramic() if kind == 2 else sampler.plastic()


def hollow(profile: Profile, segments: int = 18) -> Mesh:
    """A vessel of the outer profile with a mouth that goes a little way down."""
    edge, top = profile[-1]
    inner = max(edge * 0.84, edge - 0.01)
    return lathe(
        [*profile, (inner, top), (inner, top - 0.03), (0.002, top - 0.035)], segments=segments
    )


def with_stems(sampler: Sampler, body: Groups, mouth: float, top: float) -> Model:
    """The vase, in half of the cases with tulips, daisies, twigs, grasses or leafy branches."""
    if sampler.chance(0.5):
        return settled("vase", *body)
    kind, count = sampler.integer(0, 4), sampler.integer(3, 9)
    long = top * sampler.uniform(0.6, 1.3)
    stems: list[Mesh] = []
    heads: list[Mesh] = []
    for index in range(count):
        a = index * 2.4 + sampler.uniform(-0.4, 0.4)
        c, s = float(np.cos(a)), float(np.sin(a))
        out = mouth * 0.5 + long * sampler.uniform(0.1, 0.45)
        tip = (out * c, out * s, top + long * sampler.uniform(0.55, 1.0))
        path = arch((mouth * 0.3 * c, mouth * 0.3 * s, top - 0.03), tip, long * 0.08, 5)
        stems.append(tube(path, 0.003, 5))
        heads += _head(sampler, kind, path, float(np.degrees(a)))
        if kind == 2:
            for x, y, z in path[2:4]:
                turn = a + sampler.uniform(-1.2, 1.2)
                end = (x + 0.07 * float(np.cos(turn)), y + 0.07 * float(np.sin(turn)), z + 0.07)
                stems.append(rod((x, y, z), end, 0.002, 4))
                heads.append(ellipsoid((0.007, 0.007, 0.009), end, 6))
    bloom = sampler.foliage() if kind == 4 else sampler.plastic()
    stalk = sampler.wood() if kind == 2 else sampler.foliage()
    return settled("vase", *body, (stalk, stems), (bloom, heads))


def _head(sampler: Sampler, kind: int, path: list[list[float]], turn: float) -> list[Mesh]:
    """What grows at the end of a stem: tulip, daisy, buds, plume or leaves."""
    x, y, z = path[-1]
    if kind == 0:
        cup = lathe([(0.006, 0), (0.022, 0.018), (0.02, 0.04), (0.012, 0.055)], segments=8)
        return [cup.translated(x, y, z - 0.003)]
    if kind == 1:
        size = sampler.uniform(0.025, 0.045)
        tilt = sampler.uniform(10, 60)
        petals = [
            leaf((size * 0.5, size), (10, 15), OVAL[::2] + (0.02,), 0.1).rotated("z", 45 * i)
            for i in range(8)
        ]
        flower = [*petals, ellipsoid((size * 0.3, size * 0.3, size * 0.2), (0, 0, 0), 8)]
        return [m.rotated("y", tilt).rotated("z", turn).translated(x, y, z) for m in flower]
    if kind == 2:
        return [ellipsoid((0.008, 0.008, 0.011), (x, y, z), 6)]
    if kind == 3:
        long = sampler.uniform(0.1, 0.18)
        plume = ellipsoid((0.022, 0.022, long / 2), (0, 0, long * 0.45), 8)
        return [plume.rotated("y", 18).rotated("z", turn).translated(x, y, z)]
    blades = []
    for index, (px, py, pz) in enumerate(path[1:]):
        for side in (-1, 1):
            blade = leaf(
                (0.03, 0.055), (sampler.uniform(0, 40), 30), (OVAL, LANCE)[index % 2][::2] + (0.02,)
            )
            blades.append(blade.rotated("z", turn + side * 75 + 20 * index).translated(px, py, pz))
    return blades
