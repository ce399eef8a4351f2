"""Text of users and robots is printed literally: never as markup, never as a traceback."""

from __future__ import annotations

import ast
import io
import re
from typing import Any

import pytest
from typer.testing import CliRunner

from onemap_tools.cli.app import app
from onemap_tools.cli.terminal import (
    plain_console,
    print_json,
    progress_console,
    result_console,
    stays_up,
)
from onemap_tools.demo.summary import DemoSummary, ObjectSummary, RobotSummary, describe
from onemap_tools.errors import EXIT_FAILED, EXIT_OK
from onemap_tools.progress import SearchProgress, panel
from tests.structure import ROOT
from tests.tools.fake_gateway import fake_gateway

RUNNER = CliRunner()
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
def test_a_query_is_printed_literally(text: str) -> None:
    reply = {"text": text, "regions": [region(1)]}
    with fake_gateway({("POST", "/v1/queries"): (200, reply)}) as url:
        result = RUNNER.invoke(app, ["query", text, "--url", url])
    assert result.exit_code == EXIT_OK
    assert text in result.stdout


@pytest.mark.parametrize("text", NASTY)
def test_a_search_is_printed_literally(text: str) -> None:
    with fake_gateway({("POST", "/v1/searches"): (200, finished(text))}) as url:
        result = RUNNER.invoke(app, ["search", text, "--url", url])
    assert result.exit_code == EXIT_FAILED
    assert f"{text} was not found" in result.stdout


@pytest.mark.parametrize("name", NASTY)
def test_objects_of_a_demo_are_printed_literally(name: str) -> None:
    console = plain_console(file=io.StringIO())
    item = ObjectSummary(name, "not_found", "it is nowhere", (), 1.0, 1.0, 1.0, 1.0, 1.0)
    summary = DemoSummary((name, name), (RobotSummary("", (item,), 1.0, 1.0),), 1.0, 1.0, 1.0)
    describe(summary, f"runs/{name}/map.png", console)
    console.print(panel(SearchProgress(finished(name))))
    assert text_of(console).count(name) >= 4


def text_of(console: Any) -> str:
    return " ".join(console.file.getvalue().split())


FORBIDDEN_CALLS = {"from_markup", "render_str", "rule", "print_exception"}
TAG = re.compile(r"\[/[a-z ]*\]|\[(bold|dim|italic|red|green|yellow|blue|link)\b[^\]]*\]")


def markup_in(source: str) -> list[str]:
    """Where a module makes a console of its own, or writes or reads markup."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            function = node.func
            name = function.attr if isinstance(function, ast.Attribute) else ""
            name = function.id if isinstance(function, ast.Name) else name
            on = any(
                word.arg in ("markup", "emoji") and ast.unparse(word.value) != "False"
                for word in node.keywords
            )
            if name == "Console" or name in FORBIDDEN_CALLS or on:
                found.append(f"{node.lineno}: {ast.unparse(node)[:60]}")
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            if TAG.search(node.value):
                found.append(f"{node.lineno}: {node.value[:60]!r}")
        elif isinstance(node, ast.ImportFrom) and node.module in ("rich", "rich.markup"):
            found.append(f"{node.lineno}: imports {node.module}")
    return found


def test_all_consoles_are_created_in_one_place() -> None:
    folder = ROOT / "tools" / "onemap_tools"
    found = [
        f"{path.relative_to(ROOT)}:{place}"
        for path in sorted(folder.rglob("*.py"))
        if path.name != "terminal.py"
        for place in markup_in(path.read_text(encoding="utf-8"))
    ]
    assert found == []


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


def test_json_replaces_prose_on_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    result_console(as_json=False).print("a table")
    assert capsys.readouterr() == ("a table\n", "")
    result_console(as_json=True).print("a table")
    progress_console().print("starting")
    print_json({"ok": True})
    assert capsys.readouterr() == ('{"ok": true}\n', "a table\nstarting\n")


@pytest.mark.parametrize("terminal", [True, False])
def test_the_demo_stays_up_on_a_terminal_or_as_told(
    monkeypatch: pytest.MonkeyPatch, terminal: bool
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: terminal, raising=False)
    assert stays_up(headless=None) == terminal
    assert stays_up(headless=False)
    assert not stays_up(headless=True)
