"""The page about HTTP names every address of the gateway, and no other."""

from __future__ import annotations

import importlib
import pkgutil
import re

from fastapi import APIRouter
from starlette.routing import Route, WebSocketRoute

from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.http import routes
from onemap_gateway.http.app import DESCRIPTION
from onemap_gateway.present.live import live_document
from onemap_shared.messages import FailureCode
from tests.structure import ROOT

UNDOCUMENTED = {"/", "/favicon.ico"}
ADDRESS = re.compile(r"`(?:(?:GET|POST|PUT|DELETE|WS) )?(/[\w./{}]*)`")


def addresses() -> set[str]:
    """The paths of all routes, every parameter of an id called as on the page."""
    modules = [
        importlib.import_module(f"{routes.__name__}.{module.name}")
        for module in pkgutil.iter_modules(routes.__path__)
    ]
    routers = [
        part for module in modules for part in vars(module).values() if isinstance(part, APIRouter)
    ]
    found = [route for router in routers for route in router.routes]
    paths = {route.path_format for route in found if isinstance(route, Route | WebSocketRoute)}
    return {re.sub(r"{\w+_id}", "{id}", path) for path in paths} - UNDOCUMENTED


def test_the_page_names_every_address() -> None:
    page = (ROOT / "docs" / "http.md").read_text(encoding="utf-8")
    named = set(ADDRESS.findall(page))
    assert len(named) > 15
    assert named - {"/openapi.json"} == addresses()


def test_the_page_names_every_reason_of_a_failure() -> None:
    page = (ROOT / "docs" / "http.md").read_text(encoding="utf-8")
    listed = page.split("| `reason_code` | when |")[1].split("\n\n")[0]
    assert re.findall(r"^\| `(\w+)` \|", listed, re.MULTILINE) == [
        code.value for code in FailureCode if code
    ]


def test_page_and_document_name_every_member_of_the_live_state() -> None:
    page = (ROOT / "docs" / "http.md").read_text(encoding="utf-8")
    members = live_document(LiveState(), None, now_s=0.0, now_ns=0, with_trail=True)
    for text in (DESCRIPTION.split("`WS /v1/live`")[1], page.split("## Live state")[1]):
        assert members.keys() <= set(re.findall(r"`(\w+)`", text))
