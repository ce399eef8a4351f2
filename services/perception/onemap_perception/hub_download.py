"""Downloads a large file of the hub so that a download that broke off is continued.

The hub's own client begins a file anew in every process. Here the part that arrived stays in the
cache beside the whole files, and the next download asks for the rest only.
"""
# Talks: HTTP.
# Touches files: weights.

from __future__ import annotations

import fcntl
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import httpx

from onemap_perception.errors import ModelError
from onemap_perception.hub import HubFile, HubListing, client, first_line

CHUNK_BYTES = 1 << 20
TIMEOUT_S = 30.0  # without a byte: the connection is dead
PART = ".onemap-part"  # beside the whole files; the hub's client never reads it

OnBytes = Callable[[int], None]


def download(listing: HubListing, file: HubFile, on_bytes: OnBytes) -> None:
    """Put a large file into the hub's cache, where the hub's client links it; ModelError if not.

    on_bytes: called with the number of bytes that arrived, those of earlier downloads first.
    """
    whole = blobs_folder(listing.repo) / file.digest
    if whole.exists():
        on_bytes(file.size_bytes)
        return
    part = whole.with_name(whole.name + PART)
    try:
        part.parent.mkdir(parents=True, exist_ok=True)
        with part.open("ab") as out:
            _lock(out, listing.repo)
            if out.tell() > file.size_bytes:
                _restart(out)
            on_bytes(out.tell())
            _append(_url(listing, file), out, file.size_bytes, on_bytes)
        _keep(part, whole, file, listing.repo)
    except httpx.HTTPStatusError as refused:
        answer = f"{refused.response.status_code} {refused.response.reason_phrase}"
        raise ModelError(f"{listing.repo} cannot be fetched: {file.path}: {answer}") from refused
    except (httpx.HTTPError, OSError) as problem:
        raise ModelError(_broken_off(listing, file, part, problem)) from problem


def blobs_folder(repo: str) -> Path:
    """Where the hub's cache keeps the contents of a model's files, named by their digests."""
    client()
    from huggingface_hub import constants
    from huggingface_hub.file_download import repo_folder_name

    folder: str = repo_folder_name(repo_id=repo, repo_type="model")
    return Path(constants.HF_HUB_CACHE) / folder / "blobs"


def _url(listing: HubListing, file: HubFile) -> str:
    url: str = client().hf_hub_url(listing.repo, file.path, revision=listing.commit)
    return url


def _lock(out: BinaryIO, repo: str) -> None:
    try:
        fcntl.flock(out, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as taken:
        raise ModelError(f"{repo} is being fetched by another process: wait for it") from taken


def _append(url: str, out: BinaryIO, size_bytes: int, on_bytes: OnBytes) -> None:
    """Fetch what is missing; a connection that breaks is made anew as long as bytes arrive."""
    from huggingface_hub.utils import build_hf_headers

    headers = {**build_hf_headers(), "accept-encoding": "identity"}
    with httpx.Client(headers=headers, follow_redirects=True, timeout=TIMEOUT_S) as http:
        while (begin := out.tell()) < size_bytes:
            try:
                _receive(http, url, out, on_bytes)
            except httpx.TransportError:
                if out.tell() <= begin:
                    raise
            if out.tell() <= begin:
                raise httpx.ReadError("the server sent nothing more")


def _receive(http: httpx.Client, url: str, out: BinaryIO, on_bytes: OnBytes) -> None:
    begin = out.tell()
    with http.stream("GET", url, headers={"range": f"bytes={begin}-"}) as response:
        response.raise_for_status()
        if response.status_code != httpx.codes.PARTIAL_CONTENT:  # it sends the file from its start
            _restart(out)
            on_bytes(-begin)
        for chunk in response.iter_bytes():  # as it comes: a larger chunk is lost if it breaks off
            out.write(chunk)
            out.flush()
            on_bytes(len(chunk))


def _restart(out: BinaryIO) -> None:
    out.truncate(0)
    out.seek(0)


def _keep(part: Path, whole: Path, file: HubFile, repo: str) -> None:
    """Give the part its place if its content is what the hub announced; else remove it."""
    with part.open("rb") as content:
        arrived = hashlib.sha256()
        while chunk := content.read(CHUNK_BYTES):
            arrived.update(chunk)
    if arrived.hexdigest() != file.digest:
        part.unlink()
        raise ModelError(
            f"{repo} arrived damaged: {file.path} has the SHA-256 {arrived.hexdigest()[:12]}..., "
            f"the hub announced {file.digest[:12]}...; it was removed: fetch again"
        )
    part.replace(whole)


def _broken_off(listing: HubListing, file: HubFile, part: Path, problem: Exception) -> str:
    here = part.stat().st_size if part.exists() else 0
    return (
        f"{listing.repo} cannot be fetched: {file.path} broke off at {here / 1e6:.1f} of "
        f"{file.size_bytes / 1e6:.1f} MB ({first_line(problem)}); the same command continues there"
    )
