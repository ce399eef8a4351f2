"""The access control in ``deploy/router-tls.json5``, written from the table of roles."""

from __future__ import annotations

import json
from typing import Any

from onemap_shared.access_control import access_control

FILE = "router-tls.json5"
BEGIN = "  // begin of what `make docs-pages` writes from ROLES in onemap_shared/keys.py\n"
END = "  // end of what it writes\n"


def with_access_control(text: str) -> str:
    """The router's configuration with the access control of now in place of what it had."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}{section_text(access_control())}{END}{after}"


def section_text(section: dict[str, Any]) -> str:
    """The section as JSON5, one rule a line."""
    lines = ["  access_control: {\n"]
    for name, value in section.items():
        if not isinstance(value, list):
            lines.append(f"    {name}: {json.dumps(value)},\n")
            continue
        lines.append(f"    {name}: [\n")
        lines += [f"      {json.dumps(entry)},\n" for entry in value]
        lines.append("    ],\n")
    return "".join([*lines, "  },\n"])
