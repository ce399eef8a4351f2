"""The documents: links lead somewhere, commands exist, the citation is that of this version."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main
import yaml

from onemap_tools.cli.app import app
from tests.structure import ROOT

DOCUMENTS = sorted(
    [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
    + [*(ROOT / "docs").glob("*.md"), *(ROOT / "deploy").glob("*.md")]
    + [*(ROOT / "services").rglob("MODEL_CARD.md")]
)
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"`[^`\n]*`")
LINK = re.compile(r"\]\(([^()\s]+)\)")
HEADING = re.compile(r"^#+ +(.*)$", re.MULTILINE)
ELSEWHERE = ("http://", "https://", "mailto:")


def links(markdown: str) -> list[str]:
    """Targets of the links and pictures outside code."""
    return LINK.findall(CODE.sub("``", FENCE.sub("", markdown)))


def commands(markdown: str) -> list[str]:
    """Lines of the fences that run ``onemap``, without what a shell takes away."""
    found = []
    for fence in FENCE.findall(markdown):
        for line in fence.replace("\\\n", " ").splitlines():
            for part in re.split(r"&&|\|(?!\|)|;", line.partition(" #")[0]):
                if part.strip().startswith("onemap "):
                    found.append(part.strip().rstrip("&").strip())
    return found


def anchors(markdown: str) -> set[str]:
    """The fragments that lead to a heading, as hosts of Markdown make them."""
    found: set[str] = set()
    for heading in HEADING.findall(FENCE.sub("", markdown)):
        text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)
        anchor = re.sub(r"[^\w\- ]", "", text.lower()).strip().replace(" ", "-")
        number = 0
        while (unique := f"{anchor}-{number}" if number else anchor) in found:
            number += 1
        found.add(unique)
    return found


def broken_links(document: Path) -> Iterator[str]:
    """Targets in this document that do not exist."""
    markdown = document.read_text(encoding="utf-8")
    for target in links(markdown):
        if target.startswith(ELSEWHERE):
            continue
        path, _, fragment = target.partition("#")
        file = document.parent / path if path else document
        if not file.exists() or (
            fragment and fragment not in anchors(file.read_text(encoding="utf-8"))
        ):
            yield target


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(document: Path) -> None:
    assert list(broken_links(document)) == []


def test_a_link_that_leads_nowhere_is_seen(tmp_path: Path) -> None:
    document = tmp_path / "a.md"
    (tmp_path / "b.md").write_text("# Two `words`, *here*\n# Twice\n# Twice\n")
    document.write_text(
        "[1](b.md) [2](b.md#two-words-here) [3](b.md#twice-1) [4](#top) [5](https://nowhere)\n"
        "![6](c.png) [7](b.md#three) `[8](d.md)`\n```\n[9](e.md)\n```\n# Top\n[10](../f.md)\n"
    )
    assert list(broken_links(document)) == ["c.png", "b.md#three", "../f.md"]


def parse(command: Any, words: list[str]) -> None:
    """Read the words as a command line without running it; raises the usage error."""
    for count in (2, 1):  # 'search replay' is one command beside 'search'
        below = getattr(command, "commands", {}).get(" ".join(words[:count]))
        if below is not None:
            parse(below, words[count:])
            return
    assert not hasattr(command, "commands"), f"there is no command {words[:1]}"
    command.make_context(command.name, words)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_commands_exist(document: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for line in commands(document.read_text(encoding="utf-8")):
        _, *words = shlex.split(line)
        for word in words:
            if re.fullmatch(r"[\w-]+\.(yaml|json|mcap|glb)", word):
                Path(word).touch()
        parse(typer.main.get_command(app), words)


def test_a_command_that_does_not_exist_is_seen() -> None:
    markdown = "```sh\ncd x && onemap mapper --configuration x.yaml # no\n```\nonemap nothing\n"
    (line,) = commands(markdown)
    assert line == "onemap mapper --configuration x.yaml"
    with pytest.raises(Exception, match="--configuration"):
        parse(typer.main.get_command(app), shlex.split(line)[1:])
    with pytest.raises(AssertionError, match="there is no command"):
        parse(typer.main.get_command(app), ["mapper2"])


def test_the_citation_names_this_version_and_the_paper() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    for key in ("version", "license"):
        assert re.search(rf'^{key} = "{citation[key]}"$', project, re.MULTILINE)
    (paper,) = citation["references"]
    assert paper["title"].startswith("One Map to Find Them All: ")
    assert len(paper["authors"]) == 5
    assert citation["cff-version"] == "1.2.0"
    assert {"message", "title", "authors", "type"} <= citation.keys()
