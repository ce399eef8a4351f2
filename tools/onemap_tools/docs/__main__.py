"""``python -m onemap_tools.docs`` writes the generated pages of the checkout's ``docs/``."""

from __future__ import annotations

from pathlib import Path

from onemap_tools.docs.pages import ROOT, generated_pages


def main(folder: Path) -> None:
    """Write every generated page to ``folder``."""
    for name, text in generated_pages().items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(ROOT / "docs")
