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
from onemap_perception.config import KNOWN_MODELS
from onemap_tools.cli.app import app
from onemap_tools.errors import CliError
from onemap_tools.models import known
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
    assert set(entries) == {model.repo for model in KNOWN_MODELS}
    assert {entry["folder"] for entry in entries.values()} == {""}
    folder = put_in_cache(cache)
    here = listed()[REPO]
    assert (here["folder"], here["bytes_here"]) == (str(folder), 702)
    assert here["licence"] == "Apache-2.0"


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


def downloaded() -> Path:
    (model,) = (each for each in KNOWN_MODELS if each.repo == REPO)
    return known.download(model, model_store.look_up(model.repo, model.files))


def test_a_damaged_download_is_removed(hub: LocalHub) -> None:
    small = hub.models[REPO]["config.json"]
    small.announced = "a" * 40
    with pytest.raises(CliError, match=f"{REPO} arrived damaged: config.json; it was removed"):
        downloaded()
    small.announced = hashlib.sha1(b"blob 2\0{}").hexdigest()
    assert downloaded().is_dir()
