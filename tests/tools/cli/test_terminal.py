"""Text of users and robots is printed literally: never as markup, never as a traceback."""

from __future__ import annotations

import io
import re
from typing import Any

import httpx
import pytest

from onemap import Client
from onemap_tools.cli import remote
from onemap_tools.cli.terminal import plain_console, stays_up
from onemap_tools.demo.run import summary, verdict
from onemap_tools.judgement import ObjectSummary
from onemap_tools.progress import ProgressLines
from tests.structure import ROOT

NASTY = ("[/sofa]", "[bold]x", "[red]", ":smiley:", "[link=file:///]y", "\\[z]")


def region(rank: int) -> dict[str, Any]:
    return {"rank": rank, "score": 0.5, "centre_m": [1.0, 2.0], "extent_m": [0.0, 0.0, 1.0, 1.0]}


def finished(name: str) -> dict[str, Any]:
    result = {
        "name": name,
        "outcome": "not_found",
        "reason": f"{name} is nowhere",
        "position_m": None,
        "duration_s": 3.0,
        "path_length_m": 1.0,
    }
    return {
        "id": "s1",
        "state": "not_found",
        "reason": f"{name} was not found",
        "objects": [name],
        "results": [result],
        "target": "",
        "elapsed_s": 3.0,
        "path_length_m": 1.0,
    }


@pytest.mark.parametrize("text", NASTY)
def test_what_people_and_robots_say_is_printed_literally(text: str) -> None:
    console = plain_console(file=io.StringIO())
    remote.describe_query({"text": text, "regions": [region(1)]}, console)
    remote.describe_search(finished(text), console)
    item = ObjectSummary(text, "found", "it is here", (), 1.0, 1.0, 1.0, 1.0, 1.0, nearest=text)
    document = {**summary([text], [item], text), "search_s": 1.0, "duration_s": 1.0}
    console.print(*verdict(document, [item]), sep="\n", soft_wrap=True)
    gateway = Client(transport=httpx.MockTransport(lambda _: httpx.Response(503)))
    ProgressLines(console).show(finished(text), gateway)
    assert text_of(console).count(text) >= 8


def test_finds_are_told_by_room_and_landmark_before_metres() -> None:
    console, where = plain_console(file=io.StringIO()), "in the den, next to the desk"
    known = {"name": "bed", "where": where, "position_m": [1.0, 2.0, 0.4], "score": 0.9}
    known |= {"times_found": 2, "last_seen_at": "2026-01-01T00:00:00Z", "id": "b1"}
    remote.describe_objects({"objects": [known | {"picture": "/v1/objects/b1.jpg"}]}, console)
    found = finished("bed")
    found["results"][0] |= {"outcome": "found", "where": where, "position_m": [1.0, 2.0, 0.4]}
    remote.describe_search(found, console)
    text = text_of(console)
    assert text.index("den") < text.index("(1.00, 2.00)") < text.rindex("den")
    assert "GET /v1/objects/b1.jpg" in text


def text_of(console: Any) -> str:
    return " ".join(console.file.getvalue().split())


def test_all_consoles_are_created_in_one_place() -> None:
    """Where markup is off; a table, a panel and a print do not turn it on."""
    makes_one = re.compile(r"\bConsole\(|from_markup|markup=True|\brich\.print\b|from rich import")
    folder = ROOT / "tools" / "onemap_tools"
    found = [
        f"{path.relative_to(ROOT)}: {line}"
        for path in sorted(folder.rglob("*.py"))
        for line in path.read_text(encoding="utf-8").splitlines()
        if makes_one.search(line)
    ]
    assert len(found) == 1
    assert found[0].startswith("tools/onemap_tools/cli/terminal.py: ")


def test_the_page_never_reads_text_as_html() -> None:
    """What people and services say goes into the page as text nodes."""
    static = ROOT / "services" / "gateway" / "onemap_gateway" / "static"
    reading = re.compile(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|DOMParser|srcdoc")
    found = [
        f"{path.name}:{number}"
        for path in sorted(static.iterdir())
        if path.suffix in (".js", ".html")
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if reading.search(line)
    ]
    assert found == []


@pytest.mark.parametrize("terminal", [True, False])
def test_the_demo_stays_up_on_a_terminal_or_as_told(
    monkeypatch: pytest.MonkeyPatch, terminal: bool
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: terminal, raising=False)
    assert stays_up(headless=None) == terminal
    assert stays_up(headless=False)
    assert not stays_up(headless=True)
