"""Bottles of glass: wine, milk, beer and liqueur; and of thin plastic."""

from __future__ import annotations

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    lathe,
    rod,
    rounded_box,
    torus,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler


def tinted_glass(sampler: Sampler) -> Material:
    """Green, brown or clear glass, or any colour."""
    colour = sampler.choice([(0.08, 0.2, 0.1), (0.3, 0.16, 0.05), (0.75, 0.85, 0.82)])
    return sampler.material("plain", 0.5, colour) if sampler.chance(0.6) else sampler.plastic()


def label_around(radius: float, low: float, high: float) -> Mesh:
    """A paper band around a round body."""
    return lathe([(radius + 0.0015, low), (radius + 0.0015, high)], segments=18)


def wine_bottle(sampler: Sampler) -> Model:
    """A wine bottle: high shoulders or sloping ones, a foil on its neck, a paper label."""
    h, r = sampler.size(0.28, 0.36), sampler.size(0.037, 0.048)
    sloping = sampler.chance(0.5)
    shoulder, neck = h * (0.45 if sloping else 0.58), r * 0.38
    between = [(r * 0.72, h * 0.6)] if sloping else [(r * 0.93, h * 0.63), (r * 0.6, h * 0.68)]
    body = [(r * 0.94, 0), (r, 0.008), (r, shoulder), *between, (neck, h * 0.74), (neck, h * 0.98)]
    foil = lathe([(neck + 0.002, h * 0.8), (neck + 0.002, h), (neck * 0.5, h)], segments=14)
    ring = torus(neck + 0.003, 0.003, (0, 0, h * 0.96), 12)
    label = label_around(r, h * 0.12, shoulder * sampler.uniform(0.7, 0.95))
    return assemble(
        "bottle",
        (tinted_glass(sampler), [lathe(body, segments=18)]),
        (sampler.plastic(), [foil, ring]),
        (sampler.pale() if sampler.chance(0.6) else sampler.fabric(), [label]),
    )


def water_bottle(sampler: Sampler) -> Model:
    """A ribbed plastic water bottle with a waist, a wide label and a small screw cap."""
    h, r = sampler.size(0.22, 0.34), sampler.size(0.033, 0.05)
    ribs, pinch = sampler.integer(3, 6), sampler.uniform(0.78, 0.9)
    body = [(r * 0.85, 0.0), (r, 0.012)]
    for k in range(ribs):
        z = h * (0.06 + 0.32 * (k + 0.5) / ribs)
        body += [(r * pinch, z), (r, z + h * 0.16 / ribs)]
    top = [(r, h * 0.7), (r * 0.85, h * 0.78), (r * 0.45, h * 0.87), (r * 0.34, h * 0.9)]
    body += [*top, (r * 0.34, h * 0.94)]
    cap = cylinder(r * 0.42, h * 0.065, (0, 0, h * 0.935), 12)
    ring = cylinder(r * 0.46, 0.004, (0, 0, h * 0.915), 12)
    return assemble(
        "bottle",
        (sampler.pale() if sampler.chance(0.5) else sampler.plastic(), [lathe(body, segments=18)]),
        (sampler.plastic(), [cap, ring]),
        (sampler.fabric(), [label_around(r, h * 0.42, h * 0.68)]),
    )


def milk_bottle(sampler: Sampler) -> Model:
    """A wide-mouthed milk or juice bottle: thick neck with a rolled lip, foil cap or swing top."""
    h, r = sampler.size(0.2, 0.27), sampler.size(0.042, 0.056)
    neck = r * sampler.uniform(0.48, 0.62)
    square = sampler.chance(0.3)
    body = [
        (r * 0.93, 0),
        (r, 0.01),
        (r, h * 0.52),
        (r * 0.9, h * 0.6),
        (neck, h * 0.76),
        (neck, h * 0.92),
        (neck * 1.15, h * 0.93),
        (neck * 1.15, h * 0.97),
    ]
    glass = lathe(body, segments=8 if square else 18)
    cap = [cylinder(neck * 1.22, h * 0.04, (0, 0, h * 0.955), 16)]
    wire: list[Mesh] = []
    if sampler.chance(0.4):
        cap.append(cone((neck * 0.9, neck * 0.5), h * 0.05, (0, 0, h * 0.99), 12))
        wire = [
            rod((s * neck * 1.1, -0.004, h * 0.86), (s * neck * 0.6, 0, h * 1.03), 0.0025, 6)
            for s in (-1, 1)
        ]
        wire.append(torus(neck + 0.002, 0.0025, (0, 0, h * 0.86), 14))
    groups = [(sampler.pale() if sampler.chance(0.6) else tinted_glass(sampler), [glass])]
    groups.append((sampler.plastic(), cap))
    if wire:
        groups.append((sampler.metal(), wire))
    if not square and sampler.chance(0.5):
        groups.append((sampler.fabric(), [label_around(r, h * 0.15, h * 0.45)]))
    return assemble("bottle", *groups)


def beer_bottle(sampler: Sampler) -> Model:
    """A long-necked or stubby beer bottle with a crown cap, neck label and belly label."""
    h, r = sampler.size(0.2, 0.27), sampler.size(0.03, 0.038)
    stubby = sampler.chance(0.35)
    h = h * (0.8 if stubby else 1.0)
    r = r * (1.15 if stubby else 1.0)
    neck, shoulder = r * 0.4, h * (0.62 if stubby else 0.52)
    body = [
        (r * 0.92, 0),
        (r, 0.006),
        (r, shoulder),
        (r * 0.85, shoulder + h * 0.06),
        (neck * 1.25, shoulder + h * 0.17),
        (neck, h * 0.93),
        (neck * 1.1, h * 0.97),
    ]
    cap = cone((neck * 1.4, neck * 1.15), h * 0.03, (0, 0, h * 0.97), 12)
    z = shoulder + h * 0.19
    collar = lathe([(neck * 1.27, z), (neck * 1.17, z + h * 0.1)], segments=14)
    paper = sampler.pale() if sampler.chance(0.5) else sampler.fabric()
    labels = [label_around(r, h * 0.14, h * 0.42), *([collar] if not stubby else [])]
    return assemble(
        "bottle",
        (tinted_glass(sampler), [lathe(body, segments=16)]),
        (sampler.metal(), [cap]),
        (paper, labels),
    )


def liqueur_bottle(sampler: Sampler) -> Model:
    """A squat decanter or liqueur bottle: round, square or bulbous, with a large stopper."""
    h, r = sampler.size(0.18, 0.25), sampler.size(0.05, 0.068)
    kind, neck = sampler.integer(0, 2), r * 0.3
    rise = [(neck, h * 0.6), (neck, h * 0.76), (neck * 1.5, h * 0.77), (neck * 1.4, h * 0.8)]
    if kind == 0:
        body = [
            rounded_box((r * 1.7, r * 1.7, h * 0.55), (0, 0, 0), 0.014),
            lathe([(r * 0.6, h * 0.54), *rise], segments=14),
        ]
    elif kind == 1:
        belly = [(r * 0.7, 0), (r, h * 0.15), (r * 1.05, h * 0.3), (r * 0.7, h * 0.47)]
        body = [lathe([*belly, *rise], segments=18)]
    else:
        belly = [(r, 0), (r * 1.02, h * 0.02), (r * 0.7, h * 0.4), (r * 0.4, h * 0.52)]
        body = [lathe([*belly, *rise], segments=sampler.choice([6, 8, 18]))]
    if sampler.chance(0.5):
        stop = [
            lathe(
                [(neck * 0.9, h * 0.79), (neck * 1.9, h * 0.88), (neck * 1.3, h * 0.98), (0, h)],
                segments=12,
            )
        ]
    else:
        stop = [cylinder(neck * 1.5, h * 0.12, (0, 0, h * 0.8), 14)]
    groups = [
        (tinted_glass(sampler), body),
        (sampler.wood() if sampler.chance(0.4) else sampler.metal(), stop),
    ]
    if kind == 0:
        label = box((r * 1.2, r * 1.7 + 0.004, h * 0.3), (0, 0, h * 0.12))
        groups.append((sampler.pale(), [label]))
    return assemble("bottle", *groups)
