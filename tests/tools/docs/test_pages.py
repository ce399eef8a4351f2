"""The generated pages in ``docs/`` are what the code gives now."""

from __future__ import annotations

from pathlib import Path

import pytest

from onemap_tools.cli.config_report import SectionModels
from onemap_tools.docs import __main__ as command
from onemap_tools.docs import pages
from onemap_tools.errors import CliError

PAGES = pages.generated_pages()


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_what_the_code_gives(name: str) -> None:
    written = (pages.ROOT / "docs" / name).read_text(encoding="utf-8")
    assert written == PAGES[name], f"docs/{name} is out of date; renew it with: make docs-pages"


def test_the_command_writes_every_page(tmp_path: Path) -> None:
    command.main(tmp_path)
    written = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
    assert written == PAGES


def test_a_section_that_is_not_installed_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    models = SectionModels({}, {"mapper": "The mapper needs the package 'torch'."})
    monkeypatch.setattr(pages, "installed_models", lambda: models)
    with pytest.raises(CliError, match="torch"):
        pages.generated_pages()
