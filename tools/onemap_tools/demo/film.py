"""``python -m onemap_tools.demo.film FILE [OPTIONS]``: a film of ``onemap demo``.

FILE ends in .webp, .gif or .png. The pictures are the gateway's: map and camera.
"""

from __future__ import annotations

import io
import json
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.parse import urlencode
from urllib.request import urlopen

from PIL import Image, ImageDraw, ImageFont

from onemap_tools.processes.launch import onemap_command
from onemap_tools.processes.network import LOOPBACK, any_free_port

FORMATS = {".webp": "WEBP", ".gif": "GIF", ".png": "PNG"}
MAX_BYTES = 3_000_000  # pages that show the film load it whole
SPEED, MAX_LENGTH_S, LAST_PICTURE_S = 4.0, 15.0, 2.0  # of the film; faster if it gets too long
MAX_MOMENTS = 200
INTERVAL_S = 0.5  # between two moments
SIZE_PX, MAP_PX, CAMERA_PX = (960, 540), (532, 478), (392, 294)
MARGIN_PX, ROW_PX = 12, 26
PAGE, UNKNOWN, INK, DIM = (8, 11, 16), (15, 20, 27), (230, 237, 243), (110, 127, 147)
FOUND, ZONE = (86, 211, 100), (229, 115, 102)


@dataclass(frozen=True, slots=True)
class Moment:
    """How a search stood: the gateway's report, its pictures, and x_min, y_min, x_max, y_max.

    places: those with a name, as the gateway's documents.
    """

    report: dict[str, Any]
    map: Image.Image
    bounds_m: tuple[float, ...]
    camera: Image.Image
    places: tuple[dict[str, Any], ...] = ()


def moment_of(url: str) -> Moment | None:
    """The state of the newest search; None before there is one with a map and an image."""
    try:
        with urlopen(f"{url}/v1/searches", timeout=5) as reply:
            searches = json.load(reply)["searches"]
        if not searches:
            return None
        text = urlencode({"text": searches[0]["target"] or searches[0]["objects"][-1]})
        with urlopen(f"{url}/v1/map.png?{text}", timeout=5) as reply:
            bounds_m = tuple(map(float, reply.headers["X-OneMap-Bounds"].split(",")))
            seen = Image.open(io.BytesIO(reply.read())).convert("RGB")
        with urlopen(f"{url}/v1/camera.jpg", timeout=5) as reply:
            camera = Image.open(io.BytesIO(reply.read())).convert("RGB")
        with urlopen(f"{url}/v1/places", timeout=5) as reply:
            known = json.load(reply)["places"]
    except OSError:  # the gateway starts, ends or has no map yet
        return None
    places = (place for place in known if place["name"] and not place["suggested"])
    return Moment(searches[0], seen, bounds_m, camera, tuple(places))


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
                time.sleep(LAST_PICTURE_S)  # the demo sees the end too
                demo.send_signal(signal.SIGINT)
                demo.wait()
        time.sleep(interval_s)
    return moments


def draw(moment: Moment, bounds_m: Sequence[float], speed: float) -> Image.Image:
    """One picture; its map shows ``bounds_m``."""
    picture = Image.new("RGB", SIZE_PX, PAGE)
    x_min, y_min, x_max, y_max = bounds_m
    scale = min(MAP_PX[0] / (x_max - x_min), MAP_PX[1] / (y_max - y_min))  # pixels per metre
    left, bottom, right, top = moment.bounds_m
    seen = moment.map.resize((round((right - left) * scale), round((top - bottom) * scale)))
    area = Image.new("RGB", MAP_PX, UNKNOWN)
    area.paste(seen, (round((left - x_min) * scale), round((y_max - top) * scale)))
    picture.paste(area, (MARGIN_PX, MARGIN_PX))
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(15)
    for place in moment.places:
        for outline in place["outlines_m"]:
            at = [
                (MARGIN_PX + (x - x_min) * scale, MARGIN_PX + (y_max - y) * scale)
                for x, y in outline
            ]
            pen.polygon(at, outline=ZONE)
            pen.text(min(at), place["name"], ZONE, font, anchor="lb")
    camera = moment.camera.copy()
    camera.thumbnail(CAMERA_PX)
    column, row = 2 * MARGIN_PX + MAP_PX[0], 2 * MARGIN_PX + CAMERA_PX[1]
    picture.paste(camera, (column, MARGIN_PX))
    for number, (text, colour) in enumerate(object_lines(moment.report)):
        pen.text((column, row + number * ROW_PX), text, colour, font)
    line = SIZE_PX[1] - MARGIN_PX - ROW_PX + 4
    pen.text((MARGIN_PX, line), caption(moment.report), INK, font)
    pen.text((SIZE_PX[0] - 120, line), f"{speed:.0f} x real time", DIM, font)
    return picture


def caption(report: dict[str, Any]) -> str:
    """What is sought, the state, seconds, and how many are found, in one line."""
    found = sum(result["outcome"] == "found" for result in report["results"])
    total = f"{found} of {len(report['objects'])} found"
    elapsed = f"{report['elapsed_s']:.0f} s"
    if not report["active"]:
        return f"{total} in {elapsed}"
    if len(report["objects"]) == 1:
        return f"Looking for: {report['understood'][:90]}   {elapsed}"
    return f"Looking for: {report['target']}   {report['state']}   {elapsed}   {total}"


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


def write(file: Path, moments: Sequence[Moment]) -> str:
    """Write the film; pictures are left out, evenly, until it has at most ``MAX_BYTES``."""
    x_min, y_min, x_max, y_max = zip(*(moment.bounds_m for moment in moments), strict=True)
    bounds_m = (min(x_min), min(y_min), max(x_max), max(y_max))
    times_s = [moment.report["elapsed_s"] for moment in moments]
    speed = max(SPEED, (times_s[-1] - times_s[0]) / (MAX_LENGTH_S - LAST_PICTURE_S))
    pictures = [draw(moment, bounds_m, speed) for moment in moments]
    count = len(moments)
    while True:
        step = (len(moments) - 1) / max(count - 1, 1)
        chosen = [round(i * step) for i in range(count)]
        # In tens of milliseconds, which is what a GIF can tell apart.
        shown_ms = [round(times_s[i] / speed * 100) * 10 for i in chosen]
        lasting_ms = [max(after - before, 20) for before, after in pairwise(shown_ms)]
        lasting_ms.append(round(LAST_PICTURE_S * 1000))
        first, *others = (pictures[i] for i in chosen)
        buffer = io.BytesIO()
        options = {"append_images": others, "duration": lasting_ms, "loop": 0, "quality": 75}
        first.save(buffer, FORMATS[file.suffix.lower()], save_all=True, **options)
        size = buffer.tell()
        if size <= MAX_BYTES or count <= 2:
            break
        count = max(int(count * 0.93 * MAX_BYTES / size), 2)
    file.write_bytes(buffer.getvalue())
    length_s = sum(lasting_ms) / 1000
    return f"Film: {file} ({count} pictures, {length_s:.1f} s, {size / 1e6:.1f} MB)"


def main(arguments: Sequence[str]) -> int:
    """Run the demo with these options after the film's file; returns its exit code."""
    if not arguments or Path(arguments[0]).suffix.lower() not in FORMATS:
        print(f"usage: FILE ({', '.join(FORMATS)}) and options of 'onemap demo'", file=sys.stderr)
        return 2
    port = any_free_port()
    command = onemap_command("demo", "--no-headless", "--port", str(port), *arguments[1:])
    with subprocess.Popen(command) as demo:
        moments = record(demo, f"http://{LOOPBACK}:{port}")
    if moments:
        print(write(Path(arguments[0]), moments), file=sys.stderr)
    return demo.returncode


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
