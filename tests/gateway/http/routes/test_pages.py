"""The live page and /docs: complete without the internet."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from onemap_gateway.http.routes.pages import STATIC


@pytest.mark.parametrize("page", ["/", "/docs", "/favicon.ico"])
def test_pages_are_served(client: TestClient, page: str) -> None:
    assert client.get(page).status_code == 200


def static_files() -> list[Path]:
    return sorted(STATIC.iterdir())


@pytest.mark.parametrize("file", static_files(), ids=lambda path: path.name)
def test_static_files_load_nothing_from_elsewhere(client: TestClient, file: Path) -> None:
    assert client.get(f"/static/{file.name}").status_code == 200
    text = file.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
    assert not re.search(r"https?://|//[a-z]+\.[a-z]|@import", text)


@pytest.mark.parametrize("file", static_files(), ids=lambda path: path.name)
def test_what_static_files_refer_to_exists(client: TestClient, file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    for path in re.findall(r'(?:src|href)="(/[^"#]*)"', text):
        assert client.get(path).status_code == 200, path
    for name in re.findall(r'from "\./([^"]+)"', text):
        assert (STATIC / name).is_file()


def test_every_element_that_scripts_ask_for_is_on_the_page() -> None:
    for script in STATIC.glob("*.js"):
        html = "docs.html" if script.name == "docs.js" else "index.html"
        page = (STATIC / html).read_text(encoding="utf-8")
        text = script.read_text(encoding="utf-8")
        for name in re.findall(r'(?:by|getElementById)\("([^"]+)"\)', text):
            assert f'id="{name}"' in page, (script.name, name)


def test_no_style_or_script_is_inline() -> None:
    """The content security policy would not run it."""
    for page in STATIC.glob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert " style=" not in text
        assert not re.search(r"<script(?![^>]*src=)|\son\w+=", text)
