"""``python -m onemap_tools.docs`` writes what is generated in ``docs/`` and ``deploy/``."""

from __future__ import annotations

from pathlib import Path

from onemap_tools.docs.pages import ROOT, generated_pages
from onemap_tools.docs.router_file import FILE, with_access_control


def main(folder: Path) -> None:
    """Write every generated page to ``folder``."""
    for name, text in generated_pages().items():
        (folder / name).write_text(text, encoding="utf-8")


def write_router(file: Path) -> None:
    """Renew the access control in the router's configuration."""
    text = with_access_control(file.read_text(encoding="utf-8"))
    file.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(ROOT / "docs")
    write_router(ROOT / "deploy" / FILE)
