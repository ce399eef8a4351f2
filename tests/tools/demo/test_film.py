"""The film of a demo: moments from a gateway, spread over its length, in one file."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import build
from onemap_shared import keys
from onemap_shared.messages import SearchList, SearchState
from onemap_tools.demo import film
from tests.gateway import fakes
from tests.memory_bus import MemoryRouter

RESULT: dict[str, Any] = {"name": "bed", "outcome": "found", "duration_s": 12.0}
REPORT: dict[str, Any] = {
    "objects": ["bed", "sofa", "desk"],
    "target": "sofa",
    "state": "exploring",
    "active": True,
    "results": [RESULT],
    "elapsed_s": 20.0,
}


def moment(elapsed_s: float, size_m: float = 4.0) -> film.Moment:
    seen = Image.new("RGB", (80, 80), (int(elapsed_s) % 255, 0, 0))
    report = {**REPORT, "elapsed_s": elapsed_s}
    return film.Moment(report, seen, (0.0, 0.0, size_m, size_m), Image.new("RGB", (640, 480)))


@pytest.fixture
def router() -> Iterator[tuple[MemoryRouter, str]]:
    router = MemoryRouter()
    mapper = fakes.FakeMapper(router)
    worker = build(router.bus("gateway"), GatewayConfig(port=0))
    yield router, f"http://127.0.0.1:{worker.port}"
    worker.close()
    mapper.bus.close()


def test_a_moment_is_what_the_gateway_shows(router: tuple[MemoryRouter, str]) -> None:
    bus, url = router[0].bus("planner"), router[1]
    assert film.moment_of(url) is None
    search = fakes.search(state=SearchState.EXPLORING, objects=("sofa",))
    bus.serve(keys.SEARCH_LIST, lambda _: SearchList((search,), 0))
    camera = bus.publish(keys.ROBOT_RGBD)
    for sequence in range(500):
        camera.put(replace(fakes.rgbd(), sequence=sequence))
        if (seen := film.moment_of(url)) is not None:
            break
    assert seen is not None
    assert (seen.report["target"], seen.camera.size) == ("sofa", (32, 24))
    assert seen.bounds_m[2] > seen.bounds_m[0]


@pytest.mark.parametrize("ending", [".webp", ".gif", ".png"])
def test_a_film_repeats_and_ends_with_a_pause(ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"search{ending}"
    said = film.write(file, [moment(0.0, 2.0), moment(4.0), moment(8.0)])
    assert "3 pictures, 4.0 s" in said
    read = Image.open(io.BytesIO(file.read_bytes()))
    assert (getattr(read, "n_frames", 1), read.size) == (3, film.SIZE_PX)


def test_a_film_has_no_more_bytes_than_a_page_may_load(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film, "MAX_BYTES", 1)
    assert "(2 pictures" in film.write(tmp_path / "a.webp", [moment(float(n)) for n in range(9)])


def test_named_places_are_outlined() -> None:
    kitchen = {"name": "kitchen", "outlines_m": [[(1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0)]]}
    plain = moment(0.0)
    outlined = replace(plain, places=(kitchen,))
    bounds_m = (0.0, 0.0, 4.0, 4.0)
    one, other = (film.draw(each, bounds_m, 1.0).getcolors(10**6) for each in (plain, outlined))
    assert film.ZONE not in [colour for _, colour in one or ()]
    assert film.ZONE in [colour for _, colour in other or ()]


def test_a_long_search_is_shown_faster(tmp_path: Path) -> None:
    said = film.write(tmp_path / "a.webp", [moment(0.0), moment(130.0), moment(260.0)])
    assert "3 pictures, 15.0 s" in said


def test_the_objects_are_listed_with_how_they_stand() -> None:
    lines = [text for text, _ in film.object_lines(REPORT)]
    assert lines == ["bed: found after 12 s", "sofa: exploring", "desk: next"]
    assert film.caption(REPORT) == "Looking for: sofa   exploring   20 s   1 of 3 found"
    described = {**REPORT, "objects": ["bed"], "understood": "red bed, anywhere"}
    assert film.caption(described) == "Looking for: red bed, anywhere   20 s"
    assert film.caption({**REPORT, "active": False}) == "1 of 3 found in 20 s"


def test_another_ending_is_misuse(capsys: pytest.CaptureFixture[str]) -> None:
    assert film.main(["search.mp4"]) == film.main([]) == 2
    assert "usage: FILE" in capsys.readouterr().err
