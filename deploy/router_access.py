"""Writes the access control of ``router-tls.json5`` from ``ROLES`` in ``onemap_shared/keys.py``.

``python deploy/router_access.py`` renews the file beside it, after a change of keys or roles.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from onemap_shared.access_control import access_control

FILE = Path(__file__).with_name("router-tls.json5")
BEGIN = "  // begin of what `python deploy/router_access.py` writes from ROLES in keys.py\n"
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
        if isinstance(value, list):
            entries = "".join(f"      {json.dumps(entry)},\n" for entry in value)
            lines.append(f"    {name}: [\n{entries}    ],\n")
        else:
            lines.append(f"    {name}: {json.dumps(value)},\n")
    return "".join([*lines, "  },\n"])


if __name__ == "__main__":
    FILE.write_text(with_access_control(FILE.read_text(encoding="utf-8")), encoding="utf-8")
