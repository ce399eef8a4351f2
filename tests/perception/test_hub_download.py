"""Large files from a hub on loopback: continued, refused when damaged, never half."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from onemap_perception.errors import BackendError
from onemap_perception.model_store import (
    PART,
    HubFile,
    HubListing,
    blobs_folder,
    download,
    list_files,
)
from tests.perception.local_hub import LocalHub, ServedFile, serve_hub, use_hub

pytest.importorskip("huggingface_hub", reason="needs huggingface_hub (extra openclip)")
REPO = "google/tipsv2-b14"
SIZE = 3_000_000


@pytest.fixture
def hub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalHub]:
    """A hub with one model of one large file of noise."""
    source = tmp_path / "source"
    source.mkdir()
    (source / "model.safetensors").write_bytes(os.urandom(SIZE))
    with serve_hub() as hub:
        hub.add(REPO, source)
        use_hub(hub, tmp_path / "cache", monkeypatch)
        yield hub


def served(hub: LocalHub) -> ServedFile:
    return hub.models[REPO]["model.safetensors"]


def listed() -> tuple[HubListing, HubFile]:
    listing = list_files(REPO, ("*.safetensors",))
    (file,) = listing.files
    return listing, file


def blob(file: HubFile) -> Path:
    return blobs_folder(REPO) / file.digest


def test_a_file_arrives_whole_under_its_digest(hub: LocalHub) -> None:
    arrived: list[int] = []
    listing, file = listed()
    download(listing, file, arrived.append)
    assert blob(file).read_bytes() == served(hub).content
    assert sum(arrived) == file.size_bytes == SIZE
    assert [path.name for path in blob(file).parent.iterdir()] == [file.digest]


def test_a_download_that_broke_off_is_continued(hub: LocalHub) -> None:
    served(hub).breaks_at = 2_000_000
    listing, file = listed()
    with pytest.raises(
        BackendError, match=r"broke off at 2\.0 of 3\.0 MB .* same command continues"
    ):
        download(listing, file, lambda _: None)
    assert not blob(file).exists()
    asked = len(served(hub).ranges)
    served(hub).breaks_at = None
    arrived: list[int] = []
    download(listing, file, arrived.append)
    assert served(hub).ranges[asked:] == [2_000_000]
    assert arrived[0] == 2_000_000
    assert blob(file).read_bytes() == served(hub).content


def test_other_content_than_announced_is_removed(hub: LocalHub) -> None:
    right = served(hub).content
    served(hub).content = bytes(SIZE)
    listing, file = listed()
    with pytest.raises(BackendError, match=r"arrived damaged: model\.safetensors has the SHA-256"):
        download(listing, file, lambda _: None)
    assert list(blob(file).parent.iterdir()) == []
    served(hub).content = right
    download(listing, file, lambda _: None)
    assert blob(file).exists()


def test_a_refusal_of_the_hub_is_one_sentence(hub: LocalHub) -> None:
    listing, file = listed()
    hub.models[REPO].clear()
    with pytest.raises(BackendError) as error:
        download(listing, file, lambda _: None)
    assert str(error.value) == f"{REPO} cannot be fetched: model.safetensors: 404 Not Found"


def test_two_processes_do_not_write_one_file(hub: LocalHub) -> None:
    listing, file = listed()
    part = blob(file).with_name(file.digest + PART)
    part.parent.mkdir(parents=True)
    with part.open("ab") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(BackendError, match="is being fetched by another process"):
            download(listing, file, lambda _: None)
