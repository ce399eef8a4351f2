"""Recorded frames through the real processes: the geometry of a study room.

``mini`` is trained on renderings, so only geometry is checked. The positions below were read
off the frames by unprojecting pixels of the objects.
"""

from __future__ import annotations

import io
import statistics
from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from onemap_gateway.present.palette import DARK
from onemap_shared.geometry import U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy
from tests.end_to_end.system import START_S, System
from tests.structure import ROOT

RECORDING = ROOT.parent / "shared" / "data" / "rgbd_study"
FRAMES = 5

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.skipif(not RECORDING.is_dir(), reason=f"no recording at {RECORDING}"),
]

# x, y in metres. The front sofa stands at x -0.35 to 0.4, y -0.2 to 0.9, its back at x = -0.3;
# beside it the low wooden table with the pillow (frames 000000 and 000116). The second sofa
# stands before the wall at y = 2.9; its black seat gives no depth, its front and back do. Of the
# white table for eight, two corners of the top can be read off frame 000422.
FURNITURE = {
    "front sofa, back": (-0.3, 0.3),
    "front sofa, seat": (0.15, 0.35),
    "second sofa, front": (0.45, 2.15),
    "second sofa, back": (0.35, 2.65),
    "side table": (0.1, 1.1),
    "white table": (-2.31, 1.07),
    "white table, far corner": (-2.12, 1.52),
}
# Carpet between the camera of frame 000116 at (1.8, -0.7) and the second sofa, and between the
# first sofa and the white table.
FLOOR = {
    "before the second sofa": (1.0, 1.7),
    "on the way to it": (1.2, 1.2),
    "between the sofas": (0.6, 1.5),
    "behind the front sofa": (-0.8, -0.6),
}
NEVER_SEEN = (4.0, -3.0)  # behind the camera, which looks away from it in all frames


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """A system whose robot is the recording, after every frame was fused twice."""
    replay = {"directory": str(RECORDING), "rate_hz": 4.0}
    services = ("replay", "perception", "mapper", "gateway")
    with System(tmp_path_factory.mktemp("study"), services, {"replay": replay}) as system:
        system.until(
            lambda: system.monitor.revision and system.monitor.revision.frames_fused >= 2 * FRAMES,
            "every frame is fused",
            START_S,
        )
        yield system


def occupancy(system: System) -> tuple[GridSpec, U8]:
    """The map's cells over HTTP, indexed [ix, iy]."""
    answer = system.http.get("/v1/map.npz")
    assert answer.status_code == 200
    with np.load(io.BytesIO(answer.content), allow_pickle=False) as archive:
        cell_size_m = float(archive["cell_size_m"])
        origin = np.rint(archive["origin_m"] / cell_size_m).astype(int)
        cells: U8 = archive["occupancy"]
    return GridSpec(cell_size_m, (int(origin[0]), int(origin[1])), cells.shape), cells


def at(system: System, position: tuple[float, float]) -> Occupancy:
    grid, cells = occupancy(system)
    cell = grid.cells(np.array(position))
    return Occupancy(cells[tuple(cell)]) if grid.contains(cell) else Occupancy.UNKNOWN


def test_the_floor_lies_at_zero(study: System) -> None:
    """The median over the recording; frame 000422 shows nothing level."""
    heights: dict[int, float] = {}

    def received() -> bool:
        beat = study.monitor.beats.get("mapper")
        if beat is not None and "floor_height_m" in beat.metrics:
            heights[beat.stamp_ns] = beat.metrics["floor_height_m"]
        return len(heights) >= FRAMES

    study.until(received, "the mapper reports the floor's height")
    assert abs(statistics.median(heights.values())) < 0.05


def test_furniture_is_occupied_floor_is_free_and_what_no_camera_saw_unknown(
    study: System,
) -> None:
    found = {name: at(study, place) for name, place in (FURNITURE | FLOOR).items()}
    assert found == dict.fromkeys(FURNITURE, Occupancy.OCCUPIED) | dict.fromkeys(
        FLOOR, Occupancy.FREE
    )
    assert at(study, NEVER_SEEN) is Occupancy.UNKNOWN


def test_the_picture_shows_it(study: System) -> None:
    answer = study.http.get("/v1/map.png", params={"scale": 4, "marks": False})
    assert answer.headers["content-type"] == "image/png"
    image = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    x_min, y_min, x_max, y_max = map(float, answer.headers["X-OneMap-Bounds"].split(","))
    height, width = image.shape[:2]

    def colour(place: tuple[float, float]) -> tuple[int, ...]:
        x, y = place
        column = int((x - x_min) / (x_max - x_min) * width)
        row = int((y_max - y) / (y_max - y_min) * height)
        return tuple(int(value) for value in image[row, column, ::-1])

    assert {colour(place) for place in FURNITURE.values()} == {DARK.occupied}
    assert {colour(place) for place in FLOOR.values()} == {DARK.free}
    assert colour((x_min + 0.05, y_min + 0.05)) == DARK.unknown  # the margin around what is known


def test_the_gateway_reports_what_a_search_lacks(study: System) -> None:
    study.until(lambda: study.lacks("planner"), "/readyz names the planner")
    answer = study.http.post("/v1/searches", json={"object": "sofa"})
    assert answer.status_code == 409  # a planner would not help: a recording does not move
    assert answer.json()["type"].endswith("#problem-no_robot")
