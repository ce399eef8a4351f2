"""Models of the hub: which ones OneMap has settings for, what they hold, where they are here.

The hub is the one that ``HF_ENDPOINT`` names; ``HF_TOKEN`` opens models that need an account. The
layout is Hugging Face's cache (``HF_HOME``), shared with every other program that uses it.
"""
# Talks: asks the model hub and its cache.
# Touches files: weights.

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from fnmatch import fnmatch
from math import prod
from pathlib import Path
from types import ModuleType
from typing import Any

from onemap_perception.errors import BackendError, first_line
from onemap_shared.atomic_file import replacing

INSTALL = "pip install -e '.[openclip]'"
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
    """The hub's client; raises BackendError with the command that installs it."""
    try:
        import huggingface_hub
    except ImportError as missing:
        raise BackendError(f"models of the hub need huggingface_hub: {INSTALL}") from missing
    module: ModuleType = huggingface_hub
    return module


def list_files(repo: str, patterns: tuple[str, ...]) -> HubListing:
    """The model's files that match; asks the hub. Raises BackendError."""
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
        raise BackendError(f"{repo} holds none of {', '.join(patterns)}")
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


def blobs_folder(repo: str) -> Path:
    """Where the hub's cache keeps the contents of a model's files, named by their digests."""
    client()
    from huggingface_hub import constants
    from huggingface_hub.file_download import repo_folder_name

    folder: str = repo_folder_name(repo_id=repo, repo_type="model")
    return Path(constants.HF_HUB_CACHE) / folder / "blobs"


CHUNK_BYTES = 1 << 22


def locate(model: str, files: tuple[str, ...] = ("*",), *, runs_code: bool = False) -> Path:
    """The folder or file of a path or a hub id; raises BackendError with the command to run.

    files: patterns of those that are needed. runs_code: of the hub only the version that
    'onemap models use' showed: another program that uses the cache may have fetched a newer one.
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
        folder = cached(model, files, (SHOWN,) if runs_code else NEWEST)
    except ValueError as problem:  # the hub has rules of its own
        raise BackendError(f"the model {model} does not exist: correct the path") from problem
    if folder is not None:
        return folder
    raise BackendError(
        f"the model {model} is no path and not on this machine: onemap models use {model}"
    )


HUB_ID = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*/[A-Za-z0-9_-][A-Za-z0-9._-]*")
# In the cache, beside its client's "main": the commit whose licence and code were shown.
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
        with replacing(blobs_folder(listing.repo).parent / "refs" / SHOWN) as file:
            file.write(listing.commit.encode())
        return Path(place)
    except Exception as problem:  # of the hub's client, of HTTP, of the disk
        raise BackendError(f"{listing.repo} cannot be fetched: {first_line(problem)}") from problem


def size_bytes(folder: Path) -> int:
    """Size of all files of a folder in the cache, links followed."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def corrupt_files(folder: Path) -> list[str]:
    """Files whose content does not have the digest that the hub announced.

    The cache names each file's content by the hub's own digest: SHA-256 for large files, git's
    SHA-1 for small ones. A file that is no such link cannot be verified and is listed too.
    """
    bad = []
    for path in sorted(folder.rglob("*")):
        if path.is_dir():
            continue
        if not path.is_symlink() or not path.exists() or digest(path) != path.resolve().name:
            bad.append(str(path.relative_to(folder)))
    return bad


def discard(folder: Path, names: list[str]) -> None:
    """Remove files of a folder in the cache with their content, so that they are fetched again."""
    for name in names:
        (folder / name).resolve().unlink(missing_ok=True)
        (folder / name).unlink(missing_ok=True)


def digest(path: Path) -> str:
    """The hub's digest of a file: SHA-256, or git's SHA-1 if the name has its length."""
    name = path.resolve().name
    if len(name) == 40:
        content = path.read_bytes()
        return hashlib.sha1(b"blob %d\0" % len(content) + content).hexdigest()
    return sha256(path)


def sha256(path: Path) -> str:
    """In hexadecimal digits, of a file of any size."""
    running = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(CHUNK_BYTES):
            running.update(chunk)
    return running.hexdigest()
