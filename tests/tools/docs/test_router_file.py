"""The router's configuration holds the access control of now."""

from __future__ import annotations

from pathlib import Path

import json5

from onemap_shared.access_control import access_control
from onemap_tools.docs import __main__ as command
from onemap_tools.docs.pages import ROOT
from onemap_tools.docs.router_file import FILE, with_access_control

DEPLOYED = ROOT / "deploy" / FILE


def test_the_deployed_router_controls_access_as_the_roles_say() -> None:
    text = DEPLOYED.read_text(encoding="utf-8")
    assert text == with_access_control(text), f"{FILE} is out of date; renew: make docs-pages"
    assert json5.loads(text)["access_control"] == access_control()


def test_the_rest_of_the_file_stays(tmp_path: Path) -> None:
    file = tmp_path / FILE
    text = DEPLOYED.read_text(encoding="utf-8")
    file.write_text(text.replace('"deny"', '"allow"'), encoding="utf-8")
    command.write_router(file)
    assert file.read_text(encoding="utf-8") == text
