"""Models of the hub: which ones OneMap has settings for, what they hold, where they are here.

The hub is the one that ``HF_ENDPOINT`` names; ``HF_TOKEN`` opens models that need an account. The
layout is Hugging Face's cache (``HF_HOME``), shared with every other program that uses it.
"""
# Talks: asks the model hub and its cache.
# Touches files: weights.

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import prod
from pathlib import Path
from types import ModuleType
from typing import Any

from onemap_perception.errors import BackendError, first_line
from onemap_shared.atomic_file import remove, replacing

INSTALL = "pip install -e '.[openclip]'"
WEIGHTS = ".safetensors"


@dataclass(frozen=True, slots=True)
class HubFile:
    """A file of a model. cached: its content is on this machine."""

    path: str
    size_bytes: int
    cached: bool


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
    def missing_bytes(self) -> int:
        """What is to be downloaded."""
        return sum(file.size_bytes for file in self.files if not file.cached)

    @property
    def weights(self) -> tuple[HubFile, ...]:
        return tuple(file for file in self.files if file.path.endswith(WEIGHTS))


def client() -> ModuleType:
    """The hub's client; raises BackendError with the command that installs it."""
    try:
        import huggingface_hub
    except ImportError as missing:
        raise BackendError(f"models of the hub need huggingface_hub: {INSTALL}") from missing
    module: ModuleType = huggingface_hub
    return module


def list_files(repo: str, patterns: tuple[str, ...]) -> HubListing:
    """The model's files that match; asks the hub. Raises BackendError."""
    info = ask_hub(repo, lambda api: api.model_info(repo))
    found = ask_hub(
        repo,
        lambda api: api.snapshot_download(
            repo, revision=info.sha, allow_patterns=list(patterns), dry_run=True
        ),
    )
    files = tuple(HubFile(each.filename, each.file_size, each.is_cached) for each in found)
    if not files:
        raise BackendError(f"{repo} holds none of {', '.join(patterns)}")
    card = getattr(info, "card_data", None) or {}
    return HubListing(repo, str(info.sha), str(card.get("license") or ""), files)


def list_snapshot(repo: str, folder: Path) -> HubListing:
    """The files of a model that lies in the hub's cache; asks nobody."""
    files = tuple(
        HubFile(str(path.relative_to(folder)), path.stat().st_size, cached=True)
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    )
    return HubListing(repo, folder.name, "", files, offline=True)


def count_parameters(listing: HubListing) -> int:
    """Numbers in all of the model's weights, by the files' headers; asks the hub for those only.

    Raises BackendError.
    """
    if not listing.weights:
        raise BackendError(
            f"{listing.repo} has no weights as {WEIGHTS}, the only kind that is read"
        )

    def count(file: HubFile) -> int:
        header = ask_hub(
            listing.repo,
            lambda api: api.parse_safetensors_file_metadata(
                listing.repo, file.path, revision=listing.commit
            ),
        )
        return sum(header.parameter_count.values())

    return sum(map(count, listing.weights))


def count_parameters_here(folder: Path) -> int:
    """Numbers in all weights of a folder."""
    from safetensors import safe_open

    total = 0
    for path in folder.rglob(f"*{WEIGHTS}"):
        with safe_open(path, framework="np") as tensors:
            total += sum(prod(tensors.get_slice(name).get_shape()) for name in tensors.keys())  # noqa: SIM118
    return total


def ask_hub(repo: str, question: Callable[[Any], Any]) -> Any:
    """The hub's answer; BackendError in one sentence for whatever its client raises."""
    hub = client()
    from huggingface_hub.errors import GatedRepoError

    try:
        return question(hub.HfApi())
    except GatedRepoError as refused:
        raise BackendError(
            f"{repo} is given only to accounts that accepted its licence: accept it at "
            f"{hub.constants.ENDPOINT}/{repo}, then run: hf auth login"
        ) from refused
    except Exception as problem:  # of the hub's client and of HTTP
        raise BackendError(f"{repo} cannot be fetched: {first_line(problem)}") from problem


def cache_folder() -> Path:
    """The hub's cache."""
    client()
    from huggingface_hub import constants

    return Path(constants.HF_HUB_CACHE)


def locate(model: str, files: tuple[str, ...] = ("*",)) -> Path:
    """The folder or file of a path or a hub id; raises BackendError with the command to run.

    files: patterns of those that are needed.
    """
    try:
        place = Path(model).expanduser()
        if place.exists():
            return place
    except (OSError, RuntimeError, ValueError) as problem:  # no such user, too long, not allowed
        raise BackendError(f"the model {model} cannot be looked for: {first_line(problem)}") from (
            problem
        )
    try:
        if not HUB_ID.fullmatch(model):
            raise ValueError("it is no hub id either")
        folder = cached(model, files)
    except ValueError as problem:  # the hub has rules of its own
        raise BackendError(f"the model {model} does not exist: correct the path") from problem
    if folder is not None:
        return folder
    raise BackendError(
        f"the model {model} is no path and not on this machine: onemap models use {model}"
    )


HUB_ID = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*/[A-Za-z0-9_-][A-Za-z0-9._-]*")
# In the cache, beside its client's "main": the commit whose licence was shown.
SHOWN = "onemap"
NEWEST = (SHOWN, "main")


def cached(repo: str, files: tuple[str, ...], revisions: tuple[str, ...] = NEWEST) -> Path | None:
    """The model's folder of the first of these revisions in the cache; None if there is none."""
    hub = client()
    from huggingface_hub.errors import LocalEntryNotFoundError

    for revision in revisions:
        with suppress(LocalEntryNotFoundError):
            place = hub.snapshot_download(
                repo, revision=revision, allow_patterns=list(files), local_files_only=True
            )
            return Path(place)
    return None


def look_up(repo: str, files: tuple[str, ...]) -> HubListing:
    """The model's files as the hub lists them, or those in the cache if it does not answer.

    Raises BackendError if there are neither.
    """
    try:
        return list_files(repo, files)
    except BackendError:
        folder = cached(repo, files)
        if folder is None:
            raise
        return list_snapshot(repo, folder)


def fetch(listing: HubListing, files: tuple[str, ...]) -> Path:
    """Download the files that are listed, whatever the hub has by now; raises BackendError.

    A progress bar of the hub's client. From then on ``locate`` gives this version.
    """
    try:
        place = client().snapshot_download(
            listing.repo,
            revision=listing.commit,
            allow_patterns=list(files),
            local_files_only=listing.offline,
        )
        with replacing(Path(place).parents[1] / "refs" / SHOWN) as file:
            file.write(listing.commit.encode())
        return Path(place)
    except Exception as problem:  # of the hub's client, of HTTP, of the disk
        raise BackendError(f"{listing.repo} cannot be fetched: {first_line(problem)}") from problem


def size_bytes(folder: Path) -> int:
    """Size of all files of a folder in the cache, links followed."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def damaged_files(listing: HubListing) -> list[str]:
    """Files in the cache whose content does not have the digest that the hub announces; asks the
    hub, and knows of none where it did not answer. Raises BackendError."""
    if listing.offline:
        return []
    verified = ask_hub(
        listing.repo,
        lambda api: api.verify_repo_checksums(listing.repo, revision=listing.commit),
    )
    return [each["path"] for each in verified.mismatches]


def discard(folder: Path, names: list[str]) -> None:
    """Remove files of a folder in the cache with their content, so that they are fetched again."""
    for name in names:
        remove((folder / name).resolve())
        remove(folder / name)
