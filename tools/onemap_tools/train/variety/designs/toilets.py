"""Toilets of many makes: how the bowl stands or hangs, and where its water comes from."""

from __future__ import annotations

from onemap_simulator.generation.mesh import box, cylinder, ellipsoid, rod, rounded_box, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.sanitary import shell, stand
from onemap_tools.train.variety.designs.toilet_parts import (
    draw_pan,
    flush_handle,
    hollow_bowl,
    seat_and_cover,
    seat_material,
)
from onemap_tools.train.variety.designs.toilets_hidden_tank import furniture_unit, wall_hung


def _two_piece(sampler: Sampler, state: str) -> Model:
    pan, ceramic = draw_pan(sampler, sampler.uniform(1.9, 2.4)), sampler.ceramic()
    tank_w, tank_d = pan.width * sampler.uniform(0.95, 1.3), sampler.size(0.16, 0.21)
    tank_h = sampler.size(0.3, 0.42)
    y = pan.length / 2 + tank_d / 2 + (0.03 if state == "closed" else 0.1)
    lip = pan.height + 0.015
    body = [hollow_bowl(pan, sampler.uniform(0.5, 0.75))]
    neck = y + tank_d / 2 - 0.08
    body.append(
        rounded_box(
            (pan.width * 0.6, neck, pan.height * 0.5), (0, neck / 2, pan.height * 0.48), 0.03
        )
    )
    body.append(
        rounded_box((pan.width * 0.5, neck * 0.8, pan.height * 0.6), (0, neck * 0.4, 0), 0.03)
    )
    waist, power = sampler.uniform(0.75, 1.0), sampler.uniform(3, 9)
    profile = [(waist * 0.9, 0.0), (waist, 0.03), (1.0, tank_h)]
    body.append(shell(profile, (tank_w, tank_d), power, 12).translated(0, y, lip - 0.02))
    top = sampler.uniform(1.03, 1.1)
    lid = [(1.0, 0.0), (1.0, 0.02), (0.9, 0.032), (0.0, 0.034)]
    cover = shell(lid, (tank_w * top, tank_d * top), power, 12).translated(
        0, y, lip + tank_h - 0.02
    )
    metal = flush_handle(sampler, (0, y, lip + tank_h + 0.012), tank_w)
    if sampler.chance(0.6):
        x = tank_w * 0.36
        metal.append(tube([(x, y, lip), (x, y, 0.25), (x + 0.05, y + 0.05, 0.15)], 0.008))
    seat = seat_and_cover(sampler, pan, state)
    return stand(
        "toilet",
        (ceramic, [*body, cover]),
        (seat_material(sampler, ceramic), seat),
        (sampler.metal(), metal),
    )


def close_coupled(sampler: Sampler) -> Model:
    """A two-piece toilet: a tapered tank with a lid bolted on the bowl, all closed."""
    return _two_piece(sampler, "closed")


def lid_open(sampler: Sampler) -> Model:
    """A two-piece toilet with its lid up and the seat ring down."""
    return _two_piece(sampler, "open")


def seat_up(sampler: Sampler) -> Model:
    """A two-piece toilet with both seat and lid up: the bare bowl shows."""
    return _two_piece(sampler, "up")


def one_piece(sampler: Sampler) -> Model:
    """A one-piece toilet: a smooth skirt to the floor that flows into a low tank."""
    pan, ceramic = draw_pan(sampler, sampler.uniform(2.0, 2.6)), sampler.ceramic()
    tank_d, rise = sampler.size(0.17, 0.23), sampler.size(0.18, 0.34)
    length = pan.length + tank_d + 0.08
    skirt = sampler.uniform(0.72, 0.95)
    plinth = [
        (skirt, 0.0),
        (skirt, 0.05),
        (skirt + 0.01, 0.6 * pan.height),
        (0.97, pan.height - 0.04),
    ]
    whole = (pan.width, length)
    y = (length - pan.length) / 2
    base = shell([*plinth, (0.98, pan.height - 0.03)], whole, pan.power, 8).translated(0, y, 0)
    bowl = shell(
        [(0.9, 0), (1.0, 0.02), (1.0, 0.034), (0.7, 0.034), (0, 0.034)],
        pan.size,
        pan.power,
        pan.back,
    )
    tank_y = pan.length / 2 + tank_d / 2 + 0.07
    tank_w = pan.width * sampler.uniform(0.95, 1.12)
    flare = [
        (1.0, 0.0),
        (0.94, 0.06),
        (0.95, rise * 0.7),
        (0.97, rise),
        (0.9, rise + 0.025),
        (0, rise + 0.03),
    ]
    tank = shell(flare, (tank_w, tank_d), 4, 9).translated(0, tank_y, pan.height - 0.04)
    state = sampler.choice(("closed", "closed", "open"))
    flush = flush_handle(sampler, (0, tank_y, pan.height + rise - 0.013), tank_w)
    return stand(
        "toilet",
        (ceramic, [base, bowl.translated(0, 0, pan.height - 0.035), tank]),
        (seat_material(sampler, ceramic), seat_and_cover(sampler, pan, state)),
        (sampler.metal(), flush),
    )


def high_tank(sampler: Sampler) -> Model:
    """An old toilet: a cistern high up on brackets, a long pipe down and a pull chain."""
    pan, ceramic = draw_pan(sampler, 2.0), sampler.ceramic()
    foot, y = sampler.uniform(0.45, 0.7), pan.length / 2 + sampler.uniform(0.1, 0.14)
    bowl = hollow_bowl(pan, foot, 0.0, 0.04)
    collar = shell([(0.7, 0), (0.62, 0.05)], pan.size).translated(0, 0.04, 0)
    horn = rod((0, pan.length * 0.3, pan.height * 0.75), (0, y, pan.height * 0.75), 0.05, 10)
    z = sampler.uniform(0.85, 1.75)
    width, deep, tall = sampler.size(0.42, 0.56), sampler.size(0.17, 0.22), sampler.size(0.22, 0.33)
    wooden = sampler.chance(0.5)
    tank = [
        box((width, deep, tall), (0, y, z))
        if wooden
        else rounded_box((width, deep, tall), (0, y, z), 0.05)
    ]
    tank.append(box((width + 0.03, deep + 0.03, 0.025), (0, y, z + tall)))
    if wooden:
        tank.append(box((width + 0.02, deep + 0.02, 0.03), (0, y, z - 0.01)))
    pipe = [
        tube([(0, y, z), (0, y, pan.height * 0.85), (0, y - 0.02, pan.height * 0.75)], 0.022, 8)
    ]
    for x in (-width * 0.35, width * 0.35):
        back = y + deep / 2 - 0.015
        pipe += [
            box((0.025, 0.02, 0.2), (x, back, z - 0.22)),
            box((0.025, deep, 0.02), (x, y, z - 0.03)),
        ]
        pipe.append(rod((x, back, z - 0.2), (x, y - deep * 0.4, z - 0.02), 0.01))
    x = sampler.choice((-1, 1)) * (width / 2 + 0.05)
    pipe.append(rod((0, y, z + tall + 0.035), (x, y, z + tall + 0.04), 0.01))
    hang = z - sampler.uniform(0.1, 0.6)
    pipe.append(rod((x, y, z + tall + 0.04), (x, y, hang), 0.005))
    knob = [ellipsoid((0.018, 0.018, 0.045), (x, y, hang), 10)]
    return stand(
        "toilet",
        (ceramic, [bowl, collar, horn]),
        (sampler.wood() if wooden else ceramic, tank),
        (
            seat_material(sampler, ceramic),
            seat_and_cover(sampler, pan, sampler.choice(("closed", "open", "up"))),
        ),
        (sampler.metal(), pipe),
        (sampler.wood(), knob),
    )


def compact_square(sampler: Sampler) -> Model:
    """A small angular toilet: a box of a bowl, a thin flat seat and a slim square tank."""
    pan = draw_pan(sampler, sampler.uniform(5, 9))._replace(length=sampler.size(0.4, 0.5))
    ceramic = sampler.ceramic()
    bowl = hollow_bowl(pan, sampler.uniform(0.75, 0.95), 0.0, 0.02)
    deep, tall = sampler.size(0.13, 0.18), sampler.size(0.3, 0.42)
    y = pan.length / 2 + deep / 2 + 0.08
    width = pan.width * sampler.uniform(0.85, 1.1)
    base = rounded_box((pan.width * 0.9, deep + 0.16, pan.height), (0, y - 0.08, 0), 0.02)
    tank = rounded_box((width, deep, tall), (0, y, pan.height - 0.01), 0.02)
    lid = rounded_box((width + 0.012, deep + 0.012, 0.03), (0, y, pan.height + tall - 0.012), 0.01)
    state = sampler.choice(("closed", "closed", "open", "up"))
    return stand(
        "toilet",
        (ceramic, [bowl, base, tank, lid]),
        (seat_material(sampler, ceramic), seat_and_cover(sampler, pan, state)),
        (sampler.metal(), flush_handle(sampler, (0, y, pan.height + tall + 0.018), width)),
    )


def bidet_seat(sampler: Sampler) -> Model:
    """A toilet with a thick electric wash seat: a sloping lid, a control arm and a cable."""
    pan, ceramic = draw_pan(sampler, 2.2), sampler.ceramic()
    skirted = sampler.chance(0.5)
    bowl = hollow_bowl(pan, 0.92 if skirted else 0.6, 0.0, 0.05)
    deep, tall = sampler.size(0.16, 0.2), sampler.size(0.26, 0.38)
    y = pan.length / 2 + 0.18
    neck = rounded_box((pan.width * 0.8, 0.38, pan.height), (0, y - 0.14, 0), 0.04)
    tank = rounded_box((pan.width * 1.1, deep, tall), (0, y + 0.02, pan.height - 0.01), 0.035)
    hump = rounded_box(
        (pan.width * 1.04, 0.19, 0.13), (0, pan.length / 2 - 0.06, pan.height + 0.002), 0.05
    )
    thick = sampler.uniform(0.035, 0.05)
    lid = shell([(1.0, 0.0), (1.03, 0.02), (0.98, 0.04), (0, 0.055)], pan.size, 2.2, pan.back)
    slope = -sampler.uniform(4, 8)
    cover = lid.rotated("x", -slope).translated(0, -0.02, pan.height + thick + 0.015)
    ring = [(0.98, 0.0), (1.02, thick), (0.65, thick), (0.65, 0.0), (0.98, 0.0)]
    seat = shell(ring, pan.size, 2.2, pan.back, capped=False).translated(0, 0, pan.height + 0.003)
    side = sampler.choice((-1, 1))
    x = side * (pan.width / 2 + 0.055)
    arm = [rounded_box((0.085, 0.26, 0.06), (x, 0.1, pan.height + 0.01), 0.02)]
    keys = [
        cylinder(0.012, 0.01, (x, 0.01 + i * 0.045, pan.height + 0.067), 8)
        for i in range(sampler.integer(3, 5))
    ]
    cable = tube(
        [(x, 0.2, pan.height + 0.03), (x, y - 0.05, pan.height - 0.1), (x * 0.9, y, 0.12)], 0.007
    )
    return stand(
        "toilet",
        (ceramic, [bowl, neck, tank]),
        (sampler.plastic() if sampler.chance(0.4) else ceramic, [hump, cover, seat, *arm]),
        (sampler.dark(), [*keys, cable]),
        (
            sampler.metal(),
            flush_handle(sampler, (0, y, pan.height + tall - 0.012), pan.width * 1.1),
        ),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "toilet": (
        close_coupled,
        lid_open,
        seat_up,
        wall_hung,
        one_piece,
        high_tank,
        compact_square,
        bidet_seat,
        furniture_unit,
    )
}
