"""What the model hub says of a model: its files, their digests, its licence, its size in memory.

The hub is the one that ``HF_ENDPOINT`` names; ``HF_TOKEN`` opens models that need an account.
"""
# Talks: asks the model hub.

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatch
from math import prod
from pathlib import Path
from types import ModuleType
from typing import Any

from onemap_perception.errors import ModelError

INSTALL = "pip install 'onemap[openclip]'"
SHA256_DIGITS = 64  # git's SHA-1 has 40
WEIGHTS = ".safetensors"


@dataclass(frozen=True, slots=True)
class HubFile:
    """A file of a model. digest: SHA-256 of a large file, git's SHA-1 of a small one."""

    path: str
    size_bytes: int
    digest: str

    @property
    def large(self) -> bool:
        return len(self.digest) == SHA256_DIGITS


@dataclass(frozen=True, slots=True)
class HubListing:
    """The files of one version of a model. licence: as its page states it, empty if it does not.

    offline: the hub did not answer, and the files are those on this machine.
    """

    repo: str
    commit: str
    licence: str
    files: tuple[HubFile, ...]
    offline: bool = False

    @property
    def size_bytes(self) -> int:
        return sum(file.size_bytes for file in self.files)

    @property
    def weights(self) -> tuple[HubFile, ...]:
        return tuple(file for file in self.files if file.path.endswith(WEIGHTS))


def client() -> ModuleType:
    """The hub's client; raises ModelError with the command that installs it."""
    try:
        import huggingface_hub
    except ImportError as missing:
        raise ModelError(f"models of the hub need huggingface_hub: {INSTALL}") from missing
    module: ModuleType = huggingface_hub
    return module


def list_files(repo: str, patterns: tuple[str, ...]) -> HubListing:
    """The model's files that match; asks the hub. Raises ModelError."""
    info = ask_hub(repo, lambda api: api.model_info(repo, files_metadata=True))
    card = getattr(info, "card_data", None) or {}
    files = tuple(
        HubFile(
            each.rfilename,
            int(each.lfs.size if each.lfs else each.size or 0),
            str(each.lfs.sha256 if each.lfs else each.blob_id),
        )
        for each in info.siblings or ()
        if any(fnmatch(each.rfilename, pattern) for pattern in patterns)
    )
    if not files:
        raise ModelError(f"{repo} holds none of {', '.join(patterns)}")
    return HubListing(repo, str(info.sha), str(card.get("license") or ""), files)


def list_snapshot(repo: str, folder: Path) -> HubListing:
    """The files of a model that lies in the hub's cache; asks nobody."""
    files = tuple(
        HubFile(str(path.relative_to(folder)), path.stat().st_size, path.resolve().name)
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    )
    return HubListing(repo, folder.name, "", files, offline=True)


def count_parameters(listing: HubListing) -> int:
    """Numbers in all of the model's weights, by the files' headers; asks the hub for those only.

    Raises ModelError.
    """
    if not listing.weights:
        raise ModelError(f"{listing.repo} has no weights as {WEIGHTS}, the only kind that is read")
    return sum(
        sum(headers.parameter_count.values())
        for file in listing.weights
        for headers in [_header(listing, file.path)]
    )


def count_parameters_here(folder: Path) -> int:
    """Numbers in all weights of a folder."""
    from safetensors import safe_open

    total = 0
    for path in folder.rglob(f"*{WEIGHTS}"):
        with safe_open(path, framework="np") as tensors:
            total += sum(prod(tensors.get_slice(name).get_shape()) for name in tensors.keys())  # noqa: SIM118
    return total


def _header(listing: HubListing, path: str) -> Any:
    return ask_hub(
        listing.repo,
        lambda api: api.parse_safetensors_file_metadata(
            listing.repo, path, revision=listing.commit
        ),
    )


def ask_hub(repo: str, question: Callable[[Any], Any]) -> Any:
    """The hub's answer; ModelError in one sentence for whatever its client raises."""
    hub = client()
    from huggingface_hub.errors import GatedRepoError

    try:
        return question(hub.HfApi())
    except GatedRepoError as refused:
        raise ModelError(
            f"{repo} is given only to accounts that accepted its licence: accept it at "
            f"{hub.constants.ENDPOINT}/{repo}, then run: hf auth login"
        ) from refused
    except Exception as problem:  # of the hub's client and of HTTP
        raise ModelError(f"{repo} cannot be fetched: {first_line(problem)}") from problem


def first_line(problem: Exception) -> str:
    """The first line of an exception's text."""
    return (str(problem).strip() or repr(problem)).splitlines()[0]
