"""Bathtubs of wood: staves, hoops and a step."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, rod
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.bath_parts import Size, bath_extras
from onemap_tools.train.variety.designs.sanitary import SQUARE, faucet, ring, shell, skin, stand


def _hoops(size: Size, height: float, flare: float, power: float) -> list[Mesh]:
    """Two bands around a tub whose base is a share ``flare`` of its rim."""
    return [
        skin([ring((size[0] * s, size[1] * s), z, power) for s, z in pairs], capped=False)
        for pairs in (
            [
                (f + 0.001, z0),
                (f + 0.014, z0 + 0.002),
                (f + 0.014, z0 + 0.035),
                (f + 0.001, z0 + 0.037),
            ]
            for z0 in (height * 0.18, height * 0.82)
            for f in [flare + (1 - flare) * z0 / height]
        )
    ]


def _staves(size: Size, height: float, flare: float) -> list[Mesh]:
    """Round staves on the outside of a tub, from its base to its rim."""
    length, width = size
    staves: list[Mesh] = []
    for a in np.linspace(0, 2 * np.pi, 24, endpoint=False):
        c, s = np.cos(a), np.sin(a)
        low, high = flare * 0.5 + 0.001, 0.501
        staves.append(
            rod(
                (c * length * low, s * width * low, 0.0),
                (c * length * high, s * width * high, height + 0.004),
                0.012,
                5,
            )
        )
    return staves


def japanese_deep(sampler: Sampler) -> Model:
    """A short deep soaking tub of wooden staves or planks, with hoops and a step."""
    length, height = sampler.size(0.95, 1.35), sampler.size(0.62, 0.85)
    width = length if sampler.chance(0.5) else sampler.size(0.75, 0.95)
    size = (length, width)
    round_tub = sampler.chance(0.6)
    power = 2.0 if round_tub else SQUARE
    flare, edge = sampler.uniform(0.9, 1.0), sampler.uniform(0.06, 0.1)
    outside = [
        (flare, 0.0),
        (1.0, height),
        (1 - edge, height),
        (flare - edge - 0.02, 0.18),
        (0.0, 0.17),
    ]
    body = [shell(outside, size, power)]
    hoops = _hoops(size, height, flare, power)
    staves = _staves(size, height, flare) if round_tub else []
    step = [
        box((0.5, 0.26, 0.035), (0, -width / 2 - 0.16, 0.2)),
        *(box((0.035, 0.24, 0.2), (x, -width / 2 - 0.16, 0)) for x in (-0.2, 0.2)),
    ]
    bench = box((length * 0.3, width * 0.5, 0.03), (length * 0.28, 0, height * 0.5))
    wood = sampler.wood()
    tap = faucet(sampler, (0, width / 2 - 0.03, height))
    groups = bath_extras(sampler, (length * 1.15, width * 1.15), height)[:1] if round_tub else []
    return stand(
        "bathtub",
        (wood, [*body, *staves, bench, *(step if sampler.chance(0.6) else [])]),
        (sampler.metal(), [*hoops, *tap]),
        *groups,
    )
