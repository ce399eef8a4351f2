"""Where models are on this machine, and whether their files are intact; nothing is downloaded."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from onemap_perception import model_store
from tests.perception.hub_cache import REPO, put_in_cache, use_cache

pytest.importorskip("huggingface_hub", reason="needs huggingface_hub (extra openclip)")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    use_cache(tmp_path, monkeypatch)
    return tmp_path


def test_a_model_in_the_cache_is_located(cache: Path) -> None:
    with pytest.raises(model_store.ModelError, match=f"onemap models fetch {REPO}"):
        model_store.locate(REPO)
    folder = put_in_cache(cache)
    assert model_store.locate(REPO) == folder
    assert model_store.size_bytes(folder) == 702


def test_a_missing_model_is_fetched_only_if_allowed(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fetched: list[str] = []

    def fetch(repo: str, files: tuple[str, ...]) -> Path:
        fetched.append(repo)
        return cache

    monkeypatch.setattr(model_store, "fetch", fetch)
    with pytest.raises(model_store.ModelError):
        model_store.locate(REPO)
    assert fetched == []
    assert model_store.locate(REPO, allow_fetch=True) == cache
    assert fetched == [REPO]


def test_a_path_is_a_path(tmp_path: Path) -> None:
    assert model_store.locate(str(tmp_path)) == tmp_path
    for place in ("/nowhere/at/all", "./here", "weights.pth"):
        with pytest.raises(model_store.ModelError, match="does not exist"):
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


def test_an_unknown_model_is_an_error() -> None:
    assert model_store.known_model(REPO).backend == "coco"
    with pytest.raises(model_store.ModelError, match="'nobody/nothing' is not among the known"):
        model_store.known_model("nobody/nothing")


def test_without_the_hubs_client_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "huggingface_hub", None)
    with pytest.raises(model_store.ModelError, match=r"pip install 'onemap\[openclip\]'"):
        model_store.locate(REPO)


def test_fetch_downloads_the_files_that_are_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import huggingface_hub

    asked: list[tuple[str, list[str]]] = []

    def download(repo: str, allow_patterns: list[str]) -> str:
        asked.append((repo, allow_patterns))
        return str(tmp_path)

    monkeypatch.setattr(huggingface_hub, "snapshot_download", download)
    assert model_store.fetch(REPO, ("*.json",)) == tmp_path
    assert asked == [(REPO, ["*.json"])]


def test_a_failed_download_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    import huggingface_hub

    def offline(repo: str, **_: object) -> str:
        raise OSError("no route to host\nand more")

    monkeypatch.setattr(huggingface_hub, "snapshot_download", offline)
    with pytest.raises(model_store.ModelError, match=r"cannot be fetched: no route to host$"):
        model_store.fetch(REPO, ("*",))
