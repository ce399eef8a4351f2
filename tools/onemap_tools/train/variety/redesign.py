"""Another design in the place of a placed thing, fitted to the room that the thing takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.model import Model, Part, SupportSurface
from onemap_simulator.generation.sampler import ModelFactory, Sampler

TRIES = 3  # designs tried for one thing
ENLARGED = 1.15  # most that a design grows to fill the room
SQUEEZED = 0.6  # least share of its own size along any side; below, it is another thing
STRETCHED = 1.5  # most, where the top has to meet what stands on it
TALLER = (1.35, 1.1)  # of what it replaces: on the floor, and on furniture or a wall
WIDER = 1.04  # the same along the floor
SAME_LEVEL_M = 0.02


def redesigned(
    old: Model,
    makers: Sequence[ModelFactory],
    sampler: Sampler,
    *,
    carried_z: Sequence[float] = (),
    on_floor: bool = True,
) -> Model:
    """Another model of the category in the box of ``old``, its back where the old one's is.

    carried_z: heights in metres, in the local frame, at which things stand on the old one; the
    new one's top comes to lie there. The old model where no design tried fits.
    """
    for _ in range(TRIES):
        model = sampler.choice(makers)(sampler)
        if carried_z:
            factors = _factors_under(old, model, carried_z)
        else:
            factors = _factors(old, model, TALLER[0] if on_floor else TALLER[1])
        if factors is not None:
            return _fitted(model, old, factors)
    return old


def _factors(old: Model, new: Model, taller: float) -> F64 | None:
    """Scale (3,) into the old box, the same along all sides if possible; None if it is too far."""
    room = (old.upper - old.lower) * (WIDER, WIDER, taller)
    limits = np.minimum(room / np.maximum(new.upper - new.lower, 1e-6), ENLARGED)
    even = float(limits.min())
    # Longer than the room but not as deep: squeezed along that side only, and a little.
    factors = np.minimum(limits, max(even / SQUEEZED, even) if even < 1 else even)
    return factors if float(factors.min()) >= SQUEEZED else None


def _factors_under(old: Model, new: Model, carried_z: Sequence[float]) -> F64 | None:
    """Scale (3,) to the old box whose top surface meets what stands there; None if too far."""
    level = float(np.mean(carried_z))
    if not new.support_surfaces or np.ptp(carried_z) > SAME_LEVEL_M:
        return None
    top = max(surface.z for surface in new.support_surfaces)
    along = (old.upper - old.lower)[:2] / np.maximum((new.upper - new.lower)[:2], 1e-6)
    factors = np.array([*along, level / max(top, 1e-6)])
    inside = float(factors.min()) >= SQUEEZED and float(factors.max()) <= STRETCHED
    return factors if inside else None


def _fitted(model: Model, old: Model, factors: F64) -> Model:
    """Scaled, in the middle of the old one's width, its back at the old one's back."""
    lower, upper = model.lower * factors, model.upper * factors
    x = (old.lower[0] + old.upper[0] - lower[0] - upper[0]) / 2
    shift = np.array([x, old.upper[1] - upper[1], -lower[2]])
    parts = tuple(
        Part(replace(p.mesh, vertices=p.mesh.vertices * factors + shift), p.material)
        for p in model.parts
    )
    surfaces = tuple(_moved(surface, factors, shift) for surface in model.support_surfaces)
    return replace(model, parts=parts, support_surfaces=surfaces)


def _moved(surface: SupportSurface, factors: F64, shift: F64) -> SupportSurface:
    x0, y0 = (factors * (surface.x_min, surface.y_min, 0) + shift)[:2]
    x1, y1 = (factors * (surface.x_max, surface.y_max, 0) + shift)[:2]
    z = surface.z * factors[2] + shift[2]
    return SupportSurface(float(x0), float(y0), float(x1), float(y1), float(z))
