"""Hooks of mkdocs: pages from outside ``docs/`` and from the code, and links that hold there.

Documents link to files of the checkout, as they do on a host of repositories. On the site such
a link leads to the page that is made of the file; of a file without a page the path is shown.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
SETTINGS, MESSAGES = "settings.md", "messages.md"  # written from the code; the latter in part
CARD = "services/perception/onemap_perception/mini"
INCLUDED = {  # file of the checkout: file of the site
    "deploy/README.md": "deployment.md",
    "deploy/workstation.md": "workstation.md",
    "deploy/jetson.md": "jetson.md",
    "deploy/security.md": "security.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    f"{CARD}/MODEL_CARD.md": "model_card.md",
    f"{CARD}/confusion.png": "confusion.png",
    f"{CARD}/reliability.png": "reliability.png",
}
SOURCES = {page: source for source, page in INCLUDED.items()}
CODE_OR_LINK = re.compile(r"```.*?```|`[^`\n]*`|\[([^]\n]*)\]\(([^()\s]+)\)", re.DOTALL)
ELSEWHERE = ("http://", "https://", "mailto:", "#")


def site_links(markdown: str, folder: str, included: Mapping[str, str]) -> str:
    """The text of a document in ``folder`` of the checkout, with the links of the site."""

    def replaced(match: re.Match[str]) -> str:
        text, target = match[1], match[2]
        if target is None or target.startswith(ELSEWHERE):
            return match[0]
        path, mark, fragment = target.partition("#")
        file = posixpath.normpath(posixpath.join(folder, path))
        if file in included:
            return f"[{text}]({included[file]}{mark}{fragment})"
        if file.startswith("docs/"):
            return f"[{text}]({file.removeprefix('docs/')}{mark}{fragment})"
        if file == "README.md":
            return f"[{text}](index.md)"
        return f"{text} (`{file}`)" if text.strip("`") != file else f"`{file}`"

    return CODE_OR_LINK.sub(replaced, markdown)


def on_files(files: Any, config: Any) -> Any:
    """Add the files of ``INCLUDED`` and the page of settings to the site."""
    from mkdocs.structure.files import File

    from onemap_tools.docs.reference import settings_page

    files.append(File.generated(config, SETTINGS, content=settings_page()))
    for source, page in INCLUDED.items():
        files.append(File.generated(config, page, abs_src_path=str(ROOT / source)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Rewrite the links of one page; add what the code says of messages to theirs."""
    from onemap_tools.docs.reference import messages_reference

    if page.file.src_uri == MESSAGES:
        markdown += "\n" + messages_reference()
    source = SOURCES.get(page.file.src_uri, f"docs/{page.file.src_uri}")
    return site_links(markdown, posixpath.dirname(source), INCLUDED)
