"""Running a service inside this process, and the models of the sections."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from onemap_shared.services import SERVICES
from onemap_tools.errors import EXIT_OK, EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.services import check_robot, run, section_model


@pytest.mark.parametrize("name", SERVICES)
def test_every_service_has_a_model(name: str) -> None:
    assert section_model(name).__name__ == f"{name.capitalize()}Config"


def test_a_robot_that_cannot_start_is_reported(tmp_path: Path) -> None:
    sections = {"replay": {"directory": str(tmp_path / "nowhere")}}
    with pytest.raises(CliError, match="The replay cannot start"):
        check_robot("replay", sections)
    check_robot("simulator", {})


@pytest.mark.parametrize(
    ("end", "code"),
    [
        (SystemExit(3), 3),
        (SystemExit("a sentence"), EXIT_USAGE_ERROR),
        (None, EXIT_OK),
    ],
)
def test_a_service_runs_with_its_arguments_and_returns_its_code(
    end: SystemExit | None, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[list[str]] = []

    def run_module(module: str, **options: object) -> None:
        seen.append([module, *sys.argv])
        if end is not None:
            raise end

    monkeypatch.setattr("runpy.run_module", run_module)
    before = list(sys.argv)
    assert run("mapper", Path("x.yaml")) == code
    assert seen == [["onemap_mapper", "onemap mapper", "--config", "x.yaml"]]
    assert sys.argv == before
