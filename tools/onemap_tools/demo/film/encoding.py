"""Encodes pictures as an animation: WebP, GIF or PNG."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from onemap_gateway.present.palette import DARK, Rgb
from onemap_shared.geometry import U8
from onemap_tools.demo.film.timeline import spread
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

FORMATS = {".webp": "WEBP", ".gif": "GIF", ".png": "PNG"}
WEBP_QUALITY = 75  # percent
PALETTE_PICTURES = 12  # a GIF has one palette, chosen from every fourth pixel of these
PALETTE_STRIDE_PX = 4
PALETTE_COLOURS = 255  # the last one of 256 stands for "as before"
# Of thin lines and small marks: too few pixels for a colour of their own otherwise.
MARKS: tuple[Rgb, ...] = (DARK.path, DARK.frontier, DARK.region, DARK.found, *DARK.heat)


def check_film(path: Path) -> None:
    """CliError if no film can be written to this file: because of its ending or its folder."""
    if path.suffix.lower() not in FORMATS:
        raise CliError(
            f"--film is {path}; the name of a film ends in .webp, .gif or .png", EXIT_USAGE_ERROR
        )
    if not path.parent.is_dir():
        raise CliError(
            f"--film is {path}, but there is no folder {path.parent}: make it first",
            EXIT_USAGE_ERROR,
        )


def encode_animation(pictures: Sequence[U8], durations_ms: Sequence[int], ending: str) -> bytes:
    """The file of an animation that repeats: RGB pictures (H, W, 3), how long each is shown.

    Equal pictures that follow each other may become one, shown for as long as both.
    """
    images = [Image.fromarray(picture) for picture in pictures]
    if FORMATS[ending] != "WEBP":
        images = with_common_palette(images)
    buffer = io.BytesIO()
    images[0].save(
        buffer,
        FORMATS[ending],
        save_all=True,
        append_images=images[1:],
        duration=list(durations_ms),
        loop=0,
        optimize=False,  # it would give each picture of a GIF a palette of its own
        quality=WEBP_QUALITY,
    )
    return buffer.getvalue()


def with_common_palette(images: Sequence[Image.Image]) -> list[Image.Image]:
    """The images in one palette without dither: what stands still costs nothing then."""
    chosen = [np.asarray(image) for image in spread(images, PALETTE_PICTURES)]
    step = PALETTE_STRIDE_PX
    sample = np.vstack([image[::step, ::step] for image in chosen])
    colours = Image.fromarray(sample).quantize(PALETTE_COLOURS - len(MARKS)).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette([*colours, *(value for mark in MARKS for value in mark)])
    return [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
