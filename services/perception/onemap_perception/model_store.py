"""Models of the hub: which ones OneMap has settings for, and where they are on this machine.

The layout is Hugging Face's cache (``HF_HOME``), shared with every other program that uses it.
Only ``fetch`` uses the network.
"""
# Talks: asks the model hub and its cache.
# Touches files: weights.

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from onemap_perception.errors import ModelError
from onemap_perception.hub import HubListing, client, first_line, list_files, list_snapshot
from onemap_perception.hub_download import OnBytes, download

CHUNK_BYTES = 1 << 22


@dataclass(frozen=True, slots=True)
class KnownModel:
    """A tested model. files: patterns of those needed; about_mb: computed from the number of
    parameters, None if unknown; licence: of the weights."""

    repo: str
    backend: str
    licence: str
    about_mb: int | None
    files: tuple[str, ...]


OPEN_CLIP = ("open_clip_config.json", "open_clip_model.safetensors")
TRANSFORMERS = ("*.json", "*.txt", "*.model", "*.safetensors")
KNOWN_MODELS = (
    KnownModel(
        "laion/CLIP-convnext_large_d_320.laion2B-s29B-b131K-ft-soup",
        "openclip_convnext",
        "MIT",
        1410,
        OPEN_CLIP,
    ),
    KnownModel(
        "laion/CLIP-convnext_base_w-laion2B-s13B-b82K-augreg",
        "openclip_convnext",
        "see its page",
        720,
        OPEN_CLIP,
    ),
    KnownModel("google/tipsv2-b14", "tipsv2", "Apache-2.0", None, TRANSFORMERS),
    KnownModel("google/tipsv2-l14", "tipsv2", "Apache-2.0", None, TRANSFORMERS),
    KnownModel("nvidia/C-RADIOv3-B", "radio", "NVIDIA Open Model", None, (*TRANSFORMERS, "*.py")),
    KnownModel("PekingU/rtdetr_v2_r18vd", "coco", "Apache-2.0", 81, TRANSFORMERS),
    KnownModel("iSEE-Laboratory/llmdet_tiny", "open_vocabulary", "Apache-2.0", None, TRANSFORMERS),
    KnownModel(
        "omlab/omdet-turbo-swin-tiny-hf", "open_vocabulary", "Apache-2.0", None, TRANSFORMERS
    ),
)


def known_model(repo: str) -> KnownModel:
    """The entry of this hub id; raises ModelError."""
    for model in KNOWN_MODELS:
        if model.repo == repo:
            return model
    raise ModelError(f"{repo!r} is not among the known models; 'onemap models list' names them")


def locate(model: str, *, allow_fetch: bool = False) -> Path:
    """The folder or file of a path or a hub id; raises ModelError with the command to run."""
    place = Path(model).expanduser()
    if place.exists():
        return place
    if model.count("/") != 1 or place.is_absolute() or model.startswith("."):
        raise ModelError(f"the model {model} does not exist")
    files = next((entry.files for entry in KNOWN_MODELS if entry.repo == model), ("*",))
    folder = cached(model, files)
    if folder is not None:
        return folder
    if allow_fetch:
        return fetch(look_up(model, files), files)
    raise ModelError(f"the model {model} is not on this machine: onemap models fetch {model}")


def cached(repo: str, files: tuple[str, ...]) -> Path | None:
    """The model's folder in the cache, None if it was never fetched."""
    hub = client()
    from huggingface_hub.errors import LocalEntryNotFoundError

    try:
        place = hub.snapshot_download(repo, allow_patterns=list(files), local_files_only=True)
        return Path(place)
    except LocalEntryNotFoundError:
        return None


def look_up(repo: str, files: tuple[str, ...]) -> HubListing:
    """The model's files as the hub lists them, or those in the cache if it does not answer.

    Raises ModelError if there are neither.
    """
    try:
        return list_files(repo, files)
    except ModelError:
        folder = cached(repo, files)
        if folder is None:
            raise
        return list_snapshot(repo, folder)


def fetch(listing: HubListing, files: tuple[str, ...], on_bytes: OnBytes = lambda _: None) -> Path:
    """Download into the cache, continuing an earlier download; raises ModelError.

    on_bytes: called with the number of bytes that arrived, of the large files.
    """
    if not listing.offline:
        for file in listing.files:
            if file.large:
                download(listing, file, on_bytes)
    try:
        place = client().snapshot_download(
            listing.repo, allow_patterns=list(files), local_files_only=listing.offline
        )
        return Path(place)
    except Exception as problem:  # of the hub's client, of HTTP, of the disk
        raise ModelError(f"{listing.repo} cannot be fetched: {first_line(problem)}") from problem


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
    running = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(CHUNK_BYTES):
            running.update(chunk)
    return running.hexdigest()
