"""Where models are on this machine, and whether their files are intact; nothing is downloaded."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from onemap_perception import model_store
from onemap_perception.errors import BackendError
from onemap_perception.model_store import OnBytes
from tests.perception.hub_cache import REPO, put_in_cache, use_cache
from tests.perception.local_hub import LocalHub, serve_hub, use_hub

pytest.importorskip("huggingface_hub", reason="needs huggingface_hub (extra openclip)")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    use_cache(tmp_path, monkeypatch)
    return tmp_path


def test_a_model_in_the_cache_is_located(cache: Path) -> None:
    with pytest.raises(BackendError, match=f"onemap models fetch {REPO}"):
        model_store.locate(REPO)
    folder = put_in_cache(cache)
    assert model_store.locate(REPO) == folder
    assert model_store.size_bytes(folder) == 702


def test_a_path_is_a_path(tmp_path: Path) -> None:
    assert model_store.locate(str(tmp_path)) == tmp_path
    for place in ("/nowhere/at/all", "./here", "weights.pth"):
        with pytest.raises(BackendError, match="does not exist"):
            model_store.locate(place)


def test_files_with_another_digest_are_corrupt(cache: Path) -> None:
    folder = put_in_cache(cache)
    assert model_store.corrupt_files(folder) == []
    (folder / "model.safetensors").resolve().write_bytes(b"other")
    assert model_store.corrupt_files(folder) == ["model.safetensors"]
    (folder / "config.json").unlink()
    (folder / "config.json").write_text("{}")  # no link: its digest is unknown
    (folder / "tokenizer.json").symlink_to(cache / "nowhere")
    assert model_store.corrupt_files(folder) == [
        "config.json",
        "model.safetensors",
        "tokenizer.json",
    ]


def test_without_the_hubs_client_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "huggingface_hub", None)
    with pytest.raises(BackendError, match=r"pip install 'onemap\[openclip\]'"):
        model_store.locate(REPO)


@pytest.fixture
def hub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalHub]:
    """A hub with one model of a large file, a small one and one that is not needed."""
    source = tmp_path / "source"
    source.mkdir()
    for name in ("config.json", "model.safetensors", "training.log"):
        (source / name).write_bytes(name.encode() * 1000)
    with serve_hub() as hub:
        hub.add(REPO, source)
        use_hub(hub, tmp_path / "cache", monkeypatch)
        yield hub


NEEDED = ("*.json", "*.safetensors")


def fetch(on_bytes: OnBytes = lambda _: None) -> Path:
    return model_store.fetch(model_store.look_up(REPO, NEEDED), NEEDED, on_bytes)


def test_fetch_downloads_the_files_that_are_needed(hub: LocalHub) -> None:
    assert model_store.cached(REPO, NEEDED) is None
    arrived: list[int] = []
    folder = fetch(arrived.append)
    assert {path.name for path in folder.iterdir()} == {"config.json", "model.safetensors"}
    assert sum(arrived) == len("model.safetensors") * 1000
    assert model_store.corrupt_files(folder) == []
    assert model_store.cached(REPO, NEEDED) == folder


def test_a_model_that_arrived_in_part_is_not_here(hub: LocalHub) -> None:
    hub.models[REPO]["model.safetensors"].breaks_at = 9000
    with pytest.raises(BackendError, match=r"broke off at"):
        fetch()
    assert model_store.cached(REPO, NEEDED) is None
    hub.models[REPO]["model.safetensors"].breaks_at = None
    fetch()
    assert hub.models[REPO]["model.safetensors"].ranges[-1] == 9000


def test_a_damaged_file_is_fetched_again_once_it_is_discarded(hub: LocalHub) -> None:
    folder = fetch()
    (folder / "model.safetensors").resolve().write_bytes(b"other")
    assert model_store.corrupt_files(folder) == ["model.safetensors"]
    model_store.discard(folder, ["model.safetensors"])
    assert model_store.corrupt_files(fetch()) == []
