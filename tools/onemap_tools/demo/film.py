"""``python -m onemap_tools.demo.film FILE [OPTIONS]``: a film of a headless ``onemap demo``.

FILE ends in .webp, .gif or .png. The pictures are the gateway's: map and camera.
"""

from __future__ import annotations

import io
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlencode
from urllib.request import urlopen

from PIL import Image, ImageDraw, ImageFont

from onemap_tools.processes.launch import onemap_command
from onemap_tools.processes.network import LOOPBACK, any_free_port

T = TypeVar("T")
BoundsM = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max

FORMATS = {".webp": "WEBP", ".gif": "GIF", ".png": "PNG"}
MAX_BYTES = 3_000_000  # pages that show the film load it whole
SPEED, MAX_LENGTH_S, LAST_PICTURE_S = 4.0, 15.0, 2.0  # of the film; faster if it gets too long
MAX_MOMENTS = 200
INTERVAL_S = 0.5  # between two moments
SIZE_PX, MAP_PX, CAMERA_PX = (960, 540), (532, 478), (392, 294)
MARGIN_PX, ROW_PX = 12, 26
PAGE, UNKNOWN, INK, DIM = (8, 11, 16), (15, 20, 27), (230, 237, 243), (110, 127, 147)
FOUND = (86, 211, 100)


@dataclass(frozen=True, slots=True)
class Moment:
    """How a search stood: the gateway's report, the map's picture and bounds, the camera's."""

    report: dict[str, Any]
    map: Image.Image
    bounds_m: BoundsM
    camera: Image.Image


def moment_of(url: str) -> Moment | None:
    """The state of the newest search; None before there is one with a map and an image."""
    try:
        with urlopen(f"{url}/v1/searches", timeout=5) as reply:
            searches = json.load(reply)["searches"]
        if not searches:
            return None
        text = urlencode({"text": searches[0]["target"]})
        with urlopen(f"{url}/v1/map.png?{text}", timeout=5) as reply:
            x_min, y_min, x_max, y_max = map(float, reply.headers["X-OneMap-Bounds"].split(","))
            seen = Image.open(io.BytesIO(reply.read())).convert("RGB")
        with urlopen(f"{url}/v1/camera.jpg", timeout=5) as reply:
            camera = Image.open(io.BytesIO(reply.read())).convert("RGB")
    except OSError:  # the gateway starts, ends or has no map yet
        return None
    return Moment(searches[0], seen, (x_min, y_min, x_max, y_max), camera)


def record(demo: subprocess.Popen[bytes], url: str) -> list[Moment]:
    """Moments of the search while the demo runs; every second one goes when there are too many."""
    moments: list[Moment] = []
    interval_s = INTERVAL_S
    while demo.poll() is None:
        moment = moment_of(url)
        if moment is not None and (moment.report["active"] or moments):
            moments.append(moment)
            if len(moments) >= MAX_MOMENTS:
                moments, interval_s = moments[::2], 2 * interval_s
            if not moment.report["active"]:
                demo.wait()
        time.sleep(interval_s)
    return moments


def spread(items: Sequence[T], count: int) -> list[T]:
    """At most ``count`` (2 or more) of the items, evenly spread, with the first and the last."""
    if len(items) <= count:
        return list(items)
    step = (len(items) - 1) / (count - 1)
    return [items[round(i * step)] for i in range(count)]


def speed_of(moments: Sequence[Moment]) -> float:
    """How many times faster than the search the film is."""
    length_s = moments[-1].report["elapsed_s"] - moments[0].report["elapsed_s"]
    return max(SPEED, float(length_s) / (MAX_LENGTH_S - LAST_PICTURE_S))


def durations_ms(moments: Sequence[Moment], speed: float) -> list[int]:
    """How long each picture is shown; in tens, which is what a GIF can tell apart."""
    shown_ms = [round(each.report["elapsed_s"] / speed * 100) * 10 for each in moments]
    return [
        *(max(after - before, 20) for before, after in pairwise(shown_ms)),
        round(LAST_PICTURE_S * 1000),
    ]


def draw(moment: Moment, bounds_m: BoundsM, speed: float) -> Image.Image:
    """One picture; its map shows ``bounds_m``."""
    picture = Image.new("RGB", SIZE_PX, PAGE)
    x_min, y_min, x_max, y_max = bounds_m
    scale = min(MAP_PX[0] / (x_max - x_min), MAP_PX[1] / (y_max - y_min))  # pixels per metre
    left, bottom, right, top = moment.bounds_m
    seen = moment.map.resize((round((right - left) * scale), round((top - bottom) * scale)))
    area = Image.new("RGB", MAP_PX, UNKNOWN)
    area.paste(seen, (round((left - x_min) * scale), round((y_max - top) * scale)))
    picture.paste(area, (MARGIN_PX, MARGIN_PX))
    camera = moment.camera.copy()
    camera.thumbnail(CAMERA_PX)
    column = 2 * MARGIN_PX + MAP_PX[0]
    picture.paste(camera, (column, MARGIN_PX))
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(15)
    row = 2 * MARGIN_PX + CAMERA_PX[1]
    for text, colour in object_lines(moment.report):
        pen.text((column, row), text, colour, font)
        row += ROW_PX
    line = SIZE_PX[1] - MARGIN_PX - ROW_PX + 4
    pen.text((MARGIN_PX, line), caption(moment.report)[:110], INK, font)
    pen.text((SIZE_PX[0] - 120, line), f"{speed:.0f} x real time", DIM, font)
    return picture


def caption(report: dict[str, Any]) -> str:
    """What is sought, the state, seconds, and how many are found, in one line."""
    found = sum(result["outcome"] == "found" for result in report["results"])
    total = f"{found} of {len(report['objects'])} found"
    elapsed = f"{report['elapsed_s']:.0f} s"
    if report["active"]:
        return f"Looking for: {report['target']}   {report['state']}   {elapsed}   {total}"
    return f"{total} in {elapsed}"


def object_lines(report: dict[str, Any]) -> list[tuple[str, tuple[int, int, int]]]:
    """A line for each object: how it ended, the one that is sought, and those to come."""
    lines = []
    for result in report["results"]:
        outcome = result["outcome"].replace("_", " ")
        colour = FOUND if outcome == "found" else DIM
        lines.append((f"{result['name']}: {outcome} after {result['duration_s']:.0f} s", colour))
    for name in report["objects"][len(lines) :]:
        now = report["active"] and name == report["target"]
        lines.append((f"{name}: {report['state'] if now else 'next'}", INK if now else DIM))
    return lines[-6:]


def encode(pictures: Sequence[Image.Image], durations: Sequence[int], ending: str) -> bytes:
    """The file of an animation that repeats."""
    buffer = io.BytesIO()
    options = {"append_images": pictures[1:], "duration": list(durations), "loop": 0, "quality": 75}
    pictures[0].save(buffer, FORMATS[ending], save_all=True, **options)
    return buffer.getvalue()


def write(file: Path, moments: Sequence[Moment]) -> str:
    """Write the film; pictures are left out, evenly, until it has at most ``MAX_BYTES``."""
    corners = list(zip(*(moment.bounds_m for moment in moments), strict=True))
    bounds_m = (min(corners[0]), min(corners[1]), max(corners[2]), max(corners[3]))
    speed = speed_of(moments)
    shown = [(moment, draw(moment, bounds_m, speed)) for moment in moments]
    while True:
        durations = durations_ms([moment for moment, _ in shown], speed)
        data = encode([picture for _, picture in shown], durations, file.suffix.lower())
        if len(data) <= MAX_BYTES or len(shown) <= 2:
            break
        shown = spread(shown, max(int(len(shown) * 0.93 * MAX_BYTES / len(data)), 2))
    file.write_bytes(data)
    length_s = sum(durations) / 1000
    return f"Film: {file} ({len(shown)} pictures, {length_s:.1f} s, {len(data) / 1e6:.1f} MB)"


def main(arguments: Sequence[str]) -> int:
    """Run the demo with these options after the film's file; returns its exit code."""
    if not arguments or Path(arguments[0]).suffix.lower() not in FORMATS:
        print(f"usage: FILE ({', '.join(FORMATS)}) and options of 'onemap demo'", file=sys.stderr)
        return 2
    port = any_free_port()
    command = onemap_command("demo", "--headless", "--port", str(port), *arguments[1:])
    with subprocess.Popen(command) as demo:
        moments = record(demo, f"http://{LOOPBACK}:{port}")
    if moments:
        print(write(Path(arguments[0]), moments), file=sys.stderr)
    return demo.returncode


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
