"""The site: links that leave ``docs/``, its files, and that pages load nothing from elsewhere."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from onemap_tools.docs.site import INCLUDED, ROOT, SETTINGS, on_page_markdown, site_links

LOADED = re.compile(r"<(?:script|link|img|iframe)\b[^>]*\b(?:src|href)=\"?https?://[^>]*>")


@pytest.mark.parametrize(
    ("folder", "link", "expected"),
    [
        ("docs", "[a](robot.md#b)", "[a](robot.md#b)"),
        ("docs", "[a](#b)", "[a](#b)"),
        ("docs", "[a](https://example.org/b.md)", "[a](https://example.org/b.md)"),
        ("docs", "[a](../deploy/README.md#b)", "[a](deployment.md#b)"),
        ("docs", "[a](../README.md)", "[a](index.md)"),
        ("docs", "[robot](../examples/my_robot.py)", "robot (`examples/my_robot.py`)"),
        ("docs", "[examples/a.py](../examples/a.py)", "`examples/a.py`"),
        ("docs", "`[a](../b.py)`", "`[a](../b.py)`"),
        ("docs", "```md\n[a](../b.py)\n```", "```md\n[a](../b.py)\n```"),
        ("deploy", "[a](../docs/robot.md#b)", "[a](robot.md#b)"),
        ("", "[a](docs/robot.md)", "[a](robot.md)"),
    ],
)
def test_a_link_leads_to_a_page_or_names_the_file(folder: str, link: str, expected: str) -> None:
    assert site_links(link, folder, {"deploy/README.md": "deployment.md"}) == expected


def test_links_of_an_included_page_start_where_its_file_lies() -> None:
    page = SimpleNamespace(file=SimpleNamespace(src_uri="model_card.md"))
    assert on_page_markdown("![a](confusion.png)", page=page, config=None) == "![a](confusion.png)"
    page = SimpleNamespace(file=SimpleNamespace(src_uri="encoders.md"))
    card = "[a](../services/perception/onemap_perception/mini/MODEL_CARD.md)"
    assert on_page_markdown(card, page=page, config=None) == "[a](model_card.md)"


def test_every_page_is_in_the_navigation() -> None:
    settings = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    listed = set(re.findall(r"[\w.]+\.md", str(settings["nav"])))
    pages = {path.name for path in (ROOT / "docs").glob("*.md")}
    included = {page for page in INCLUDED.values() if page.endswith(".md")}
    assert listed == pages | included | {SETTINGS}


@pytest.mark.slow
@pytest.mark.skipif(find_spec("mkdocs") is None, reason="needs mkdocs: pip install '.[docs]'")
def test_pages_load_nothing_from_elsewhere(tmp_path: Path) -> None:
    built = build(ROOT / "docs", tmp_path)
    assert built.returncode == 0, built.stderr
    pages = list(tmp_path.rglob("*.html"))
    assert len(pages) > 15
    assert "ONEMAP__GATEWAY__PORT" in (tmp_path / "settings.html").read_text("utf-8")
    assert 'id="odometry"' in (tmp_path / "messages.html").read_text("utf-8")
    assert [hit for page in pages for hit in LOADED.findall(page.read_text("utf-8"))] == []


@pytest.mark.slow
@pytest.mark.skipif(find_spec("mkdocs") is None, reason="needs mkdocs: pip install '.[docs]'")
def test_a_broken_link_fails(tmp_path: Path) -> None:
    copied = shutil.copytree(ROOT / "docs", tmp_path / "docs")
    with (copied / "index.md").open("a", encoding="utf-8") as page:
        page.write("\n[a](nowhere.md) and [b](robot.md#no-section)\n")
    built = build(copied, tmp_path / "site")
    assert built.returncode != 0
    assert "nowhere.md" in built.stderr
    assert "#no-section" in built.stderr


def build(docs: Path, site: Path) -> subprocess.CompletedProcess[str]:
    """The site of this folder of documents, as ``make docs`` builds it."""
    settings = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    settings |= {"docs_dir": str(docs), "hooks": [str(ROOT / hook) for hook in settings["hooks"]]}
    file = site.parent / f"{site.name}.yml"
    file.write_text(yaml.safe_dump(settings, sort_keys=False), encoding="utf-8")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(file)]
    return subprocess.run([*command, "-d", str(site)], capture_output=True, text=True, check=False)
