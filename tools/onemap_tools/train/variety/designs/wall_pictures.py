"""Pictures on walls: gilt, mounted, unframed, hung from strips, round."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    front_panel,
    rod,
    rounded_box,
    tube,
)
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.drawn_art import artwork, mounted
from onemap_tools.train.variety.designs.flat_forms import (
    ellipse_outline,
    moulding,
    rounded_outline,
    settled,
    upright,
    window,
)


def edge_of(sampler: Sampler) -> Material:
    """The material of a frame."""
    if sampler.chance(0.5):
        return sampler.wood()
    return sampler.metal() if sampler.chance(0.6) else sampler.plastic()


def _size(sampler: Sampler, low: float, high: float) -> tuple[float, float]:
    """Width and height: upright, square, wide or a long strip."""
    longer = sampler.size(low, high)
    other = longer * sampler.choice((0.5, 0.66, 0.75, 0.8, 1.0))
    return (longer, other) if sampler.chance(0.5) else (other, longer)


def gilt_frame(sampler: Sampler) -> Model:
    """An ornate old frame: a broad stepped moulding with corner rosettes and beads."""
    width, height = _size(sampler, 0.5, 1.1)
    bar, deep = sampler.uniform(0.07, 0.14), sampler.uniform(0.035, 0.06)
    bars = [window((width, height), bar * 0.4, deep)]
    cove = window((width - bar * 0.78, height - bar * 0.78), bar * 0.35, deep * 0.6)
    lip = window((width - bar * 1.46, height - bar * 1.46), bar * 0.27, deep * 0.85)
    bars += [cove.translated(0, 0, bar * 0.39), lip.translated(0, 0, bar * 0.73)]
    ornaments: list[Mesh] = []
    r = bar * sampler.uniform(0.4, 0.6)
    for x in (-1, 1):
        for z in (0, 1):
            at = (x * (width / 2 - bar * 0.5), -deep * 0.7, bar * 0.5 + z * (height - bar))
            ornaments.append(ellipsoid((r, deep * 0.6, r), at, 10))
    if sampler.chance(0.6):
        crest = (width * 0.14, deep * 0.6, bar * 0.45)
        ornaments.append(ellipsoid(crest, (0, -deep * 0.7, height - bar * 0.35), 10))
        ornaments.append(ellipsoid(crest, (0, -deep * 0.7, bar * 0.35), 10))
    if sampler.chance(0.5):
        for share in np.linspace(-0.5, 0.5, 14).tolist():
            for level in (bar * 0.2, height - bar * 0.2):
                bead = (share * (width - 2 * bar), -deep, level)
                ornaments.append(ellipsoid((0.012, 0.01, 0.012), bead, 6))
    inner = (width - 1.9 * bar, height - 1.9 * bar)
    art = front_panel(*inner, (0, -deep * 0.3, bar * 0.95))
    gold = sampler.metal() if sampler.chance(0.6) else sampler.wood()
    image = Material(artwork(sampler.rng, *inner))
    return settled("picture", (gold, [*bars, *ornaments]), (image, [art]))


def mounted_print(sampler: Sampler) -> Model:
    """A slim frame, a wide paper mount with bevelled edge and a small print within."""
    width, height = _size(sampler, 0.35, 0.95)
    bar, deep = sampler.uniform(0.008, 0.025), sampler.uniform(0.015, 0.035)
    share = sampler.uniform(0.12, 0.28)
    margin = min(width, height) * share
    frame = window((width, height), bar, deep)
    paper = box((width - bar, 0.006, height - bar), (0, -0.008, bar / 2))
    inner = (width - 2 * margin, height - 2 * margin)
    rim = window((inner[0] + 0.012, inner[1] + 0.012), 0.008, 0.003, -0.011)
    art = front_panel(*inner, (0, -0.0135, margin))
    image = Material(artwork(sampler.rng, *inner))
    return settled(
        "picture",
        (edge_of(sampler), [frame]),
        (sampler.pale(), [paper, rim.translated(0, 0, margin - 0.006)]),
        (image, [art]),
    )


def bare_canvas(sampler: Sampler) -> Model:
    """A canvas on a deep stretcher without a frame, or with a shadow gap around it."""
    width, height = _size(sampler, 0.4, 1.4)
    deep = sampler.uniform(0.02, 0.05)
    body = rounded_box((width, deep, height), (0, -deep / 2, 0), 0.004)
    art = front_panel(width - 0.008, height - 0.008, (0, -deep - 0.002, 0.004))
    groups = [(sampler.pale() if sampler.chance(0.5) else sampler.fabric(), [body])]
    if sampler.chance(0.35):
        gap = 0.012
        tray = window((width + 2 * gap + 0.016, height + 2 * gap + 0.016), 0.008, deep + 0.008)
        back = box((width + 2 * gap, 0.006, height + 2 * gap), (0, 0.001, -gap))
        groups.append((edge_of(sampler), [tray.translated(0, 0, -gap - 0.008), back]))
    image = Material(artwork(sampler.rng, width, height))
    return settled("picture", *groups, (image, [art]))


def poster_on_strips(sampler: Sampler) -> Model:
    """A poster or scroll between a strip above and one below, on a cord over a nail."""
    width = sampler.size(0.35, 0.8)
    height, thin = width * sampler.uniform(1.2, 1.7), sampler.uniform(0.01, 0.018)
    round_bars = sampler.chance(0.4)
    over = sampler.choice((0.0, 0.02))
    strips: list[Mesh] = []
    for z in (0.0, height):
        x = width / 2 + over
        if round_bars:
            strips.append(rod((-x, -thin, z), (x, -thin, z), thin))
            strips += [ellipsoid((thin * 1.6,) * 3, (s * x, -thin, z), 8) for s in (-1, 1)]
        else:
            strips.append(box((2 * x, 2 * thin, 0.03), (0, -thin, z - 0.015)))
    sheet = box((width - 0.004, 0.003, height), (0, -thin + 0.001, 0))
    art = front_panel(width - 0.01, height - 0.02, (0, -thin - 0.003, 0.01))
    groups = [(edge_of(sampler), strips), (sampler.pale(), [sheet])]
    if sampler.chance(0.7):
        peak = height + width * sampler.uniform(0.15, 0.35)
        cord = tube(
            [(-width * 0.4, -thin, height), (0, -thin, peak), (width * 0.4, -thin, height)], 0.003
        )
        nail = cylinder(0.006, 0.02, segments=6).rotated("x", 90).translated(0, 0, peak)
        groups.append((sampler.dark(), [cord, nail]))
    image = Material(artwork(sampler.rng, width, height))
    return settled("picture", *groups, (image, [art]))


def round_picture(sampler: Sampler) -> Model:
    """A round or oval picture in a moulded rim, some square within a round mount."""
    width = sampler.size(0.3, 0.75)
    height = width * sampler.choice((1.0, 1.0, 1.3, 0.77))
    deep, outline = sampler.uniform(0.02, 0.04), ellipse_outline(width, height, 28)
    if sampler.chance(0.2):
        outline = rounded_outline(width, height, width * 0.3)
    inner = sampler.uniform(0.78, 0.92)
    steps = [
        (1.0, 0.0),
        (1.0, deep * 0.6),
        ((1 + inner) / 2, deep),
        (inner, deep * 0.5),
        (inner, 0),
    ]
    rim = moulding(outline, steps, (0, 0, height / 2))
    plate = upright(outline * (inner + 0.02), 0.008, (0, 0, height / 2))
    image = Material(artwork(sampler.rng, width, height))
    if sampler.chance(0.5):
        w, h = width * inner * 0.6, height * inner * 0.6
        art = front_panel(w, h, (0, -0.0105, height / 2 - h / 2))
        return settled(
            "picture", (edge_of(sampler), [rim]), (sampler.pale(), [plate]), (image, [art])
        )
    uv = plate.vertices[plate.faces][..., [0, 2]] / (width, -height) + (0.5, 1.0)
    art = Mesh(plate.vertices, plate.faces, uv)
    return settled("picture", (edge_of(sampler), [rim]), (image, [art]))


def box_frame(sampler: Sampler) -> Model:
    """A plain frame of any section: flat, round bars crossing at the corners, or a deep tray."""
    width, height = _size(sampler, 0.35, 1.0)
    kind, bar = sampler.integer(0, 2), sampler.uniform(0.015, 0.06)
    if kind == 0:
        deep = sampler.uniform(0.04, 0.07)
        frame = [window((width, height), bar, deep)]
    elif kind == 1:
        deep, over = 0.02, sampler.uniform(0.03, 0.07)
        frame = [
            box((width + 2 * over, deep, 0.025), (0, -deep * 1.3, z)) for z in (0, height - 0.025)
        ]
        frame += [
            box((0.025, deep, height + 2 * over), (s * (width / 2 - 0.0125), -deep, -over))
            for s in (-1, 1)
        ]
        bar = 0.025
    else:
        deep = 0.03
        frame = [rod((-width / 2, -0.015, z), (width / 2, -0.015, z), 0.014) for z in (0, height)]
        frame += [
            rod((s * width / 2, -0.015, 0), (s * width / 2, -0.015, height), 0.014) for s in (-1, 1)
        ]
        bar = 0.014
    back = box((width - bar, 0.008, height - bar), (0, -0.004, bar / 2))
    art = front_panel(width - 1.6 * bar, height - 1.6 * bar, (0, -0.012, 0.8 * bar))
    image = artwork(sampler.rng, width, height)
    if sampler.chance(0.3):
        image = mounted(sampler.rng, image, 0.15)
    return settled("picture", (edge_of(sampler), [*frame, back]), (Material(image), [art]))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "picture": (
        gilt_frame,
        mounted_print,
        bare_canvas,
        poster_on_strips,
        round_picture,
        box_frame,
    )
}
