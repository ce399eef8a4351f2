"""Kinds of variety: what may change in an apartment, and how much."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from onemap_simulator.generation.sampler import ModelFactory
from onemap_simulator.generation.style import TRAINING as PLAIN_STYLE
from onemap_simulator.generation.style import Style
from onemap_simulator.rendering.camera_poses import CameraPoseRange
from onemap_tools.train.variety import shapes, surfaces
from onemap_tools.train.variety.designs import catalogue

Range = tuple[float, float]

# Every height from a low robot's to a person's hand; pitch as a tilted or hand-held camera's.
ANY_VIEW = CameraPoseRange(camera_height_m=(0.3, 1.6), pitch_rad=(-0.35, 0.65))


@dataclass(frozen=True, slots=True)
class Variety:
    """What ``vary`` changes in an apartment of ``style``.

    designs: by category; one of them takes the place of a thing with probability ``redesign``.
    surfaces: families of ``surfaces`` that materials are redrawn from, each with probability
    ``retexture``; warps: one of them bends each model, with probability ``warp``. spread: of
    proportions, a standard deviation of the logarithm; part_spread: the same of single parts.
    soften, recombine, screen, no_ceiling: probabilities. scale: of the whole apartment.
    strangers: least and most number of things without a name. gloss: share of the materials
    that shine. exposure: light over that of the style, as a logarithm. ``own_camera``: whether
    pictures are taken by a camera with a tone curve of its own.
    """

    name: str
    style: Style
    designs: Mapping[str, tuple[ModelFactory, ...]]
    redesign: float
    surfaces: tuple[str, ...]
    retexture: float
    warps: tuple[shapes.Warp, ...]
    warp: float
    spread: float
    part_spread: float
    soften: float
    recombine: float
    screen: float
    no_ceiling: float
    scale: Range
    strangers: tuple[int, int]
    gloss: float
    exposure: Range
    views: CameraPoseRange = ANY_VIEW
    fov_rad: Range = (0.9, 1.9)
    own_camera: bool = False


VARIED = Variety(
    name="designs",
    style=replace(
        PLAIN_STYLE,
        name="varied",
        saturation=(0.0, 1.0),
        value=(0.06, 1.0),
        light=(0.25, 1.3),
        ambient=(0.15, 0.75),
    ),
    designs=catalogue.TRAINING,
    redesign=0.7,
    surfaces=surfaces.TRAINING,
    retexture=0.55,
    warps=(shapes.taper, shapes.lean),
    warp=0.35,
    spread=0.13,
    part_spread=0.12,
    soften=0.4,
    recombine=0.4,
    screen=0.7,
    no_ceiling=0.15,
    scale=(0.85, 1.2),
    strangers=(5, 11),
    gloss=0.35,
    exposure=(-0.5, 0.4),
)
# Trained on by nobody: for the calibration, to compare trainings by, and a column of the card.
VALIDATION = Variety(
    name="validation designs",
    style=replace(
        PLAIN_STYLE,
        name="validation",
        saturation=(0.0, 0.9),
        value=(0.1, 1.0),
        light=(0.2, 1.4),
        ambient=(0.1, 0.5),
    ),
    designs=catalogue.VALIDATION,
    redesign=0.7,
    surfaces=surfaces.VALIDATION,
    retexture=0.75,
    warps=(shapes.twist, shapes.bow),
    warp=0.7,
    spread=0.2,
    part_spread=0.2,
    soften=0.5,
    recombine=0.5,
    screen=0.8,
    no_ceiling=0.1,
    scale=(0.85, 1.2),
    strangers=(5, 11),
    gloss=0.5,
    exposure=(-0.6, 0.5),
    own_camera=True,
)
