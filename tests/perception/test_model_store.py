"""Models of a hub on loopback and of the cache: listed, located, fetched, never half."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from onemap_perception import model_store
from onemap_perception.config import PerceptionConfig
from onemap_perception.errors import BackendError
from onemap_perception.model_store import (
    count_parameters,
    count_parameters_here,
    list_files,
    list_snapshot,
)
from onemap_perception.service import build
from onemap_shared.runner import StartError
from tests.memory_bus import MemoryRouter
from tests.perception.hub_cache import REPO, put_in_cache, use_cache
from tests.perception.local_hub import COMMIT, LocalHub, ServedFile, serve_hub, use_hub

pytest.importorskip("huggingface_hub", reason="needs huggingface_hub (extra openclip)")
NUMBERS = 1_500_000  # of half precision
NEEDED = ("*.json", "*.safetensors")
WEIGHTS = "model.safetensors"


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """Weights of 3 MB that are noise, a small file, and one that is not needed."""
    from safetensors.numpy import save_file

    folder = tmp_path / "source"
    folder.mkdir()
    noise = np.random.default_rng(0).integers(0, 2**15, NUMBERS).astype(np.uint16)
    save_file({"a": noise.view(np.float16)}, folder / WEIGHTS)
    (folder / "config.json").write_text("{}")
    (folder / "training.log").write_text("a page")
    return folder


@pytest.fixture
def hub(source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalHub]:
    with serve_hub() as hub:
        hub.add(REPO, source)
        use_hub(hub, tmp_path / "cache", monkeypatch)
        yield hub


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    use_cache(tmp_path, monkeypatch)
    return tmp_path


def served(hub: LocalHub) -> ServedFile:
    return hub.models[REPO][WEIGHTS]


def fetch() -> Path:
    return model_store.fetch(model_store.look_up(REPO, NEEDED), NEEDED)


def test_a_model_is_listed_with_its_licence_and_parameters(hub: LocalHub, source: Path) -> None:
    listing = list_files(REPO, NEEDED)
    assert (listing.commit, listing.licence, listing.offline) == (COMMIT, "apache-2.0", False)
    assert {file.path for file in listing.files} == {"config.json", WEIGHTS}
    size = sum((source / file.path).stat().st_size for file in listing.files)
    assert listing.size_bytes == listing.missing_bytes == size
    assert count_parameters(listing) == count_parameters_here(source) == NUMBERS
    assert not served(hub).ranges  # the weights themselves were not fetched


def test_a_model_of_the_cache_is_listed_without_the_hub(tmp_path: Path) -> None:
    listing = list_snapshot(REPO, put_in_cache(tmp_path))
    assert (listing.offline, listing.size_bytes, listing.missing_bytes) == (True, 702, 0)
    assert {file.path for file in listing.files} == {"config.json", WEIGHTS}


def test_fetch_downloads_what_is_needed_and_again_what_is_discarded(hub: LocalHub) -> None:
    assert model_store.cached(REPO, NEEDED) is None
    folder = fetch()
    assert {path.name for path in folder.iterdir()} == {"config.json", WEIGHTS}
    assert (folder / WEIGHTS).read_bytes() == served(hub).content
    listing = model_store.look_up(REPO, NEEDED)
    assert (listing.missing_bytes, model_store.damaged_files(listing)) == (0, [])
    assert model_store.cached(REPO, NEEDED) == folder
    (folder / WEIGHTS).resolve().write_bytes(b"other")
    assert model_store.damaged_files(listing) == [WEIGHTS]
    model_store.discard(folder, [WEIGHTS])
    fetch()
    assert model_store.damaged_files(listing) == []


def test_a_refusal_of_the_hub_is_one_sentence(hub: LocalHub) -> None:
    listing = model_store.look_up(REPO, NEEDED)
    hub.models.clear()
    with pytest.raises(BackendError, match=f"^{REPO} cannot be fetched: .+"):
        model_store.fetch(listing, NEEDED)


@pytest.mark.parametrize(
    "place",
    [
        "/nowhere/at/all",
        "./here",
        "weights.pth",
        "my models/tips",
        "a/b/c",
        "a/b/",
        "a--b/c",
        "~nobody/x",
    ],
)
def test_a_path_that_does_not_exist_is_refused_at_the_start(place: str) -> None:
    """With exit code 2: no supervisor tries it again."""
    tips = {"backend": "tipsv2", "model": place}
    config = PerceptionConfig.model_validate({"encoder": tips})
    with pytest.raises(StartError, match=f"the model {place} ") as refused:
        build(MemoryRouter().bus("perception"), config)
    assert not refused.value.temporary
    assert "\n" not in str(refused.value)


def test_a_path_that_is_too_long_is_one_sentence() -> None:
    with pytest.raises(BackendError, match="cannot be looked for"):
        model_store.locate("a" * 5000)


def test_what_is_fetched_is_what_was_shown(hub: LocalHub, source: Path) -> None:
    """The hub has a newer version by then; another program fetches that one."""
    listing = model_store.look_up(REPO, NEEDED)
    weights = served(hub).content
    (source / "config.json").write_text('{"newer": true}')
    hub.push(REPO, source, "0" * 39 + "2")
    folder = model_store.fetch(listing, NEEDED)
    assert (folder.name, (folder / "config.json").read_text()) == (COMMIT, "{}")
    assert (folder / WEIGHTS).read_bytes() == weights
    newer = Path(model_store.client().snapshot_download(REPO, allow_patterns=list(NEEDED)))
    assert newer != folder
    assert model_store.locate(REPO, NEEDED) == folder
    again = model_store.fetch(model_store.look_up(REPO, NEEDED), NEEDED)
    assert model_store.locate(REPO, NEEDED) == again == newer


def test_without_the_hubs_client_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "huggingface_hub", None)
    with pytest.raises(BackendError, match=r"pip install -e '\.\[openclip\]'"):
        model_store.locate(REPO)
