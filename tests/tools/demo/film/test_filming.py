"""A film is written however the search ends."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from onemap_tools.demo.film.filming import filming
from onemap_tools.errors import EXIT_INTERRUPTED, CliError
from tests.tools.demo.film.test_recorder import FakeServices


@pytest.fixture
def services() -> FakeServices:
    services = FakeServices()
    services.serve_map()
    return services


def film(services: FakeServices, path: Path, error: Exception | None = None) -> str:
    """What is printed while a search of one moment is filmed; ``error`` ends it."""
    out = io.StringIO()
    with filming(path, services.router.bus(), Console(file=out, width=300)) as recorder:
        services.search()
        services.frame()
        recorder.update(0.0)
        if error is not None:
            raise error
    return out.getvalue()


def test_a_finished_search_has_a_film(services: FakeServices, tmp_path: Path) -> None:
    path = tmp_path / "search.gif"
    printed = film(services, path)
    assert path.exists()
    assert f"Film: {path} (" in printed
    assert "2 pictures" in printed


def test_a_failed_search_has_a_film(services: FakeServices, tmp_path: Path) -> None:
    path = tmp_path / "search.webp"
    with pytest.raises(CliError, match="mapper ended"):
        film(services, path, CliError("mapper ended with code 1"))
    assert path.exists()


def test_ctrl_c_ends_without_a_film(services: FakeServices, tmp_path: Path) -> None:
    path = tmp_path / "search.webp"
    with pytest.raises(CliError, match="Stopped"):
        film(services, path, CliError("Stopped.", EXIT_INTERRUPTED))
    assert not path.exists()


def test_without_a_map_there_is_no_film(tmp_path: Path) -> None:
    path = tmp_path / "search.webp"
    assert "No film: there was no map" in film(FakeServices(), path)
    assert not path.exists()
