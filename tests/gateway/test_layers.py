"""The folders of the gateway import in one direction: bus <- present <- http <- service."""

from __future__ import annotations

import ast
from pathlib import Path

import onemap_gateway

PACKAGE = Path(onemap_gateway.__file__).parent
MAY_IMPORT = {
    "bus": {"bus"},
    "present": {"bus.live_state", "present"},
    "http": {"bus", "present", "http", "config"},
}


def imports(path: Path) -> set[str]:
    """The modules that a file imports."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(str(node.module))
    return names


def test_folders_import_only_what_lies_below_them() -> None:
    upward = [
        f"{path.relative_to(PACKAGE)}: {name}"
        for folder, below in MAY_IMPORT.items()
        for path in (PACKAGE / folder).rglob("*.py")
        for name in imports(path)
        if name.startswith("onemap_gateway.")
        and not any(f"{name}.".startswith(f"onemap_gateway.{part}.") for part in below)
    ]
    assert upward == []
