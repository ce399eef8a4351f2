"""What a hub on loopback says of its models."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from onemap_perception.errors import BackendError
from onemap_perception.model_store import (
    count_parameters,
    count_parameters_here,
    list_files,
    list_snapshot,
)
from tests.perception.hub_cache import put_in_cache
from tests.perception.local_hub import COMMIT, LocalHub, serve_hub, use_hub

pytest.importorskip("huggingface_hub", reason="needs huggingface_hub (extra openclip)")
REPO = "google/tipsv2-b14"


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """Two files of weights, 6 and 4 numbers, one of half precision; and two other files."""
    from safetensors.numpy import save_file

    folder = tmp_path / "source"
    folder.mkdir()
    save_file({"a": np.zeros((2, 3), np.float32)}, folder / "model-1.safetensors")
    save_file({"b": np.zeros(4, np.float16)}, folder / "model-2.safetensors")
    (folder / "config.json").write_text("{}")
    (folder / "README.md").write_text("a page")
    return folder


@pytest.fixture
def hub(source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalHub]:
    with serve_hub() as hub:
        hub.add(REPO, source)
        use_hub(hub, tmp_path / "cache", monkeypatch)
        yield hub


def test_a_model_is_listed_with_its_licence(hub: LocalHub, source: Path) -> None:
    listing = list_files(REPO, ("*.json", "*.safetensors"))
    assert (listing.commit, listing.licence, listing.offline) == (COMMIT, "apache-2.0", False)
    assert {file.path: file.large for file in listing.files} == {
        "config.json": False,
        "model-1.safetensors": True,
        "model-2.safetensors": True,
    }
    named = [source / file.path for file in listing.files]
    assert listing.size_bytes == sum(path.stat().st_size for path in named)


def test_parameters_are_counted_without_fetching_the_weights(hub: LocalHub, source: Path) -> None:
    assert count_parameters(list_files(REPO, ("*.safetensors",))) == 10
    assert all(not file.ranges for file in hub.models[REPO].values())
    assert count_parameters_here(source) == 10


def test_a_model_that_needs_an_account_says_where_to_accept_its_licence(hub: LocalHub) -> None:
    hub.gated.add(REPO)
    with pytest.raises(
        BackendError, match=f"accept it at {hub.url}/{REPO}, then run: hf auth login"
    ):
        list_files(REPO, ("*",))


def test_a_model_of_the_cache_is_listed_without_the_hub(tmp_path: Path) -> None:
    listing = list_snapshot(REPO, put_in_cache(tmp_path))
    assert (listing.offline, listing.size_bytes) == (True, 702)
    assert {file.path: file.large for file in listing.files} == {
        "config.json": False,
        "model.safetensors": True,
    }
