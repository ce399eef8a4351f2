"""The page and the documentation: plain files, complete without the internet."""

from __future__ import annotations

from pathlib import Path

import fastapi_offline
from fastapi import APIRouter
from fastapi.responses import FileResponse, RedirectResponse
from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from onemap_gateway.http.context import GatewayDep
from onemap_gateway.http.middleware import FOLDER

STATIC = Path(__file__).parents[2] / "static"
SWAGGER_UI = Path(fastapi_offline.__file__).parent / "static"  # Swagger UI's own files
REVALIDATE = {"Cache-Control": "no-cache"}  # an update of the robot shows at the next visit

router = APIRouter(include_in_schema=False)


@router.get("/")
async def get_page(gateway: GatewayDep) -> Response:
    """The live page; that of the first of several robots where the gateway has none of its own."""
    if gateway.robots and gateway.cache.state.odometry is None:
        return RedirectResponse(f"{FOLDER}{next(iter(gateway.robots))}/", headers=REVALIDATE)
    return FileResponse(STATIC / "index.html", headers=REVALIDATE)


@router.get("/docs")
async def get_docs() -> FileResponse:
    """The documentation of the interface, made from /openapi.json in the browser."""
    return FileResponse(STATIC / "docs.html", headers=REVALIDATE)


@router.get("/favicon.ico")
async def get_icon() -> FileResponse:
    """The icon for browsers that do not read the page's link to it."""
    return FileResponse(STATIC / "icon.svg", headers=REVALIDATE)


class StaticPages(StaticFiles):
    """Static files that browsers revalidate."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """The file, with the header that makes browsers revalidate it."""
        response = await super().get_response(path, scope)
        response.headers.update(REVALIDATE)
        return response
