"""``onemap models`` on a made-up cache; nothing is downloaded."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from onemap_perception import model_store
from onemap_tools.cli.app import app

pytest.importorskip("huggingface_hub", reason="needs huggingface_hub (extra openclip)")
REPO = "PekingU/rtdetr_v2_r18vd"
COMMIT = "0" * 39 + "1"


def put_in_cache(cache: Path, repo: str = REPO) -> Path:
    """A snapshot of two files as the hub's client leaves it; returns the folder."""
    root = cache / f"models--{repo.replace('/', '--')}"
    folder, blobs = root / "snapshots" / COMMIT, root / "blobs"
    for place in (folder, blobs, root / "refs"):
        place.mkdir(parents=True)
    (root / "refs" / "main").write_text(COMMIT)
    small, large = b"{}", b"weights" * 100
    sha1 = hashlib.sha1(b"blob 2\0" + small).hexdigest()
    sha256 = hashlib.sha256(large).hexdigest()
    for name, digest, content in (
        ("config.json", sha1, small),
        ("model.safetensors", sha256, large),
    ):
        (blobs / digest).write_bytes(content)
        (folder / name).symlink_to(blobs / digest)
    return folder


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache of the hub's client, and no way to the network."""
    import huggingface_hub.constants

    monkeypatch.setattr(huggingface_hub.constants, "HF_HUB_CACHE", str(tmp_path))
    monkeypatch.setattr(huggingface_hub.constants, "HF_HUB_OFFLINE", True)
    real = huggingface_hub.snapshot_download

    def local(repo: str, **options: object) -> str:
        return str(real(repo, cache_dir=tmp_path, **options))

    monkeypatch.setattr(huggingface_hub, "snapshot_download", local)
    return tmp_path


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["models", *arguments])
    return result.exit_code, result.output


def test_the_list_says_what_is_here(cache: Path) -> None:
    code, text = run("list", "--json")
    assert code == 0
    entries = json.loads(text.splitlines()[-1])["models"]
    assert {entry["repo"] for entry in entries} == {
        model.repo for model in model_store.KNOWN_MODELS
    }
    assert {entry["folder"] for entry in entries} == {""}
    folder = put_in_cache(cache)
    here = next(
        entry
        for entry in json.loads(run("list", "--json")[1].splitlines()[-1])["models"]
        if entry["repo"] == REPO
    )
    assert (here["folder"], here["bytes_here"]) == (str(folder), 702)
    assert here["licence"] == "Apache-2.0"


def test_a_whole_model_is_whole_and_a_changed_file_is_named(cache: Path) -> None:
    folder = put_in_cache(cache)
    assert run("verify", REPO) == (0, f"{REPO}: whole\n")
    (folder / "model.safetensors").resolve().write_bytes(b"other")
    code, text = run("verify")
    assert code == 1
    assert "damaged: model.safetensors" in text
    (folder / "config.json").unlink()
    (folder / "config.json").write_text("{}")
    assert model_store.corrupt_files(folder) == ["config.json", "model.safetensors"]


def test_what_is_not_here_is_told_with_the_command(cache: Path) -> None:
    code, text = run("verify", REPO)
    assert code == 1
    assert f"onemap models fetch {REPO}" in text
    assert run("verify") == (0, "No known model lies on this machine.\n")
    assert run("verify", "nobody/nothing")[0] == 2
    with pytest.raises(model_store.ModelError, match=f"onemap models fetch {REPO}"):
        model_store.locate(REPO)


def test_fetch_downloads_what_is_needed_and_checks_it(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import huggingface_hub

    asked: list[tuple[str, object]] = []

    def download(repo: str, allow_patterns: object) -> str:
        asked.append((repo, allow_patterns))
        return str(put_in_cache(cache, repo))

    monkeypatch.setattr(huggingface_hub, "snapshot_download", download)
    code, text = run("fetch", REPO, "--json")
    assert code == 0
    assert asked == [(REPO, list(model_store.known_model(REPO).files))]
    assert json.loads(text.splitlines()[-1])["bytes_here"] == 702
    assert run("fetch", "nobody/nothing")[0] == 2


def test_a_failed_download_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    import huggingface_hub

    def offline(repo: str, **_: object) -> str:
        raise OSError("no route to host\nand a long story")

    monkeypatch.setattr(huggingface_hub, "snapshot_download", offline)
    code, text = run("fetch", REPO)
    assert code == 1
    assert f"{REPO} cannot be fetched: no route to host\n" in text


def test_a_start_fetches_only_when_told_to(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
