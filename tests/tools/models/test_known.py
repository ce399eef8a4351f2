"""``onemap models`` on a generated cache; nothing is downloaded."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from onemap_perception import model_store
from onemap_perception.errors import BackendError
from onemap_tools.cli.app import app
from tests.perception.hub_cache import REPO, put_in_cache, use_cache
from tests.perception.local_hub import LocalHub, serve_hub, use_hub

pytest.importorskip("huggingface_hub", reason="needs huggingface_hub (extra openclip)")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache of the hub's client, without access to the network."""
    use_cache(tmp_path, monkeypatch)
    return tmp_path


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["models", *arguments])
    return result.exit_code, result.output


def listed() -> dict[str, Any]:
    code, text = run("list", "--json")
    assert code == 0
    return {entry["repo"]: entry for entry in json.loads(text.splitlines()[-1])["models"]}


def test_the_list_has_every_known_model(cache: Path) -> None:
    entries = listed()
    assert set(entries) == {model.repo for model in model_store.KNOWN_MODELS}
    assert {entry["folder"] for entry in entries.values()} == {""}
    folder = put_in_cache(cache)
    here = listed()[REPO]
    assert (here["folder"], here["bytes_here"]) == (str(folder), 702)
    assert here["licence"] == "Apache-2.0"


def test_changed_files_of_a_model_are_named(cache: Path) -> None:
    folder = put_in_cache(cache)
    assert run("verify", REPO) == (0, f"{REPO}: whole\n")
    (folder / "model.safetensors").resolve().write_bytes(b"other")
    code, text = run("verify")
    assert code == 1
    assert "damaged: model.safetensors; delete " in " ".join(text.split())
    (folder / "config.json").unlink()
    (folder / "config.json").write_text("{}")
    assert model_store.corrupt_files(folder) == ["config.json", "model.safetensors"]


def test_an_absent_model_is_reported_with_the_command(cache: Path) -> None:
    code, text = run("verify", REPO)
    assert code == 1
    assert f"onemap models fetch {REPO}" in text
    assert run("verify") == (0, "No known model lies on this machine.\n")
    assert run("verify", "nobody/nothing")[0] == 2
    with pytest.raises(BackendError, match=f"onemap models fetch {REPO}"):
        model_store.locate(REPO)


@pytest.fixture
def hub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalHub]:
    """A hub with one known model."""
    source = tmp_path / "source"
    source.mkdir()
    (source / "config.json").write_text("{}")
    (source / "model.safetensors").write_bytes(b"weights" * 100)
    with serve_hub() as hub:
        hub.add(REPO, source)
        use_hub(hub, tmp_path / "cache", monkeypatch)
        yield hub


def test_fetch_downloads_what_is_needed_and_checks_it(hub: LocalHub) -> None:
    code, text = run("fetch", REPO, "--json")
    assert code == 0
    assert json.loads(text.splitlines()[-1])["bytes_here"] == 702
    assert run("verify", REPO) == (0, f"{REPO}: whole\n")
    assert run("fetch", "nobody/nothing")[0] == 2


def test_a_damaged_download_is_removed(hub: LocalHub) -> None:
    small = hub.models[REPO]["config.json"]
    small.announced = "a" * 40
    code, text = run("fetch", REPO)
    assert code == 1
    assert f"{REPO} arrived damaged: config.json; it was removed: fetch again" in text
    small.announced = hashlib.sha1(b"blob 2\0{}").hexdigest()
    assert run("fetch", REPO)[0] == 0
