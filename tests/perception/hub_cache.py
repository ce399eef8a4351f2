"""A cache of the model hub without a network."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

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


def use_cache(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the hub's client use this folder, offline."""
    import huggingface_hub.constants

    monkeypatch.setattr(huggingface_hub.constants, "HF_HUB_CACHE", str(cache))
    monkeypatch.setattr(huggingface_hub.constants, "HF_HUB_OFFLINE", True)
    real = huggingface_hub.snapshot_download

    def local(repo: str, **options: object) -> str:
        return str(real(repo, cache_dir=cache, **options))

    monkeypatch.setattr(huggingface_hub, "snapshot_download", local)
