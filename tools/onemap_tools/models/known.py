"""Known models of the hub on this machine: list and download."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.text import Text

from onemap_perception import model_store
from onemap_perception.config import KNOWN_MODELS, KnownModel
from onemap_perception.errors import BackendError
from onemap_tools.errors import EXIT_FAILED, CliError

if TYPE_CHECKING:
    from rich.console import Console

MEGABYTE = 1e6


@contextmanager
def model_errors(exit_code: int = EXIT_FAILED) -> Iterator[None]:
    """Turn a BackendError into a CliError with this exit code."""
    try:
        yield
    except BackendError as problem:
        raise CliError(str(problem), exit_code) from problem


def inventory() -> list[dict[str, Any]]:
    """Every known model; ``folder`` is empty and ``bytes_here`` 0 if it is not on this machine."""
    with model_errors():
        return [
            _document(model, model_store.cached(model.repo, model.files)) for model in KNOWN_MODELS
        ]


def download(model: KnownModel, listing: model_store.HubListing) -> Path:
    """Fetch the version of a model that was listed, and verify it; CliError if it is not whole."""
    with model_errors():
        folder = model_store.fetch(listing, model.files)
        damaged = model_store.damaged_files(listing)
    if damaged:
        model_store.discard(folder, damaged)
        names = ", ".join(damaged)
        raise CliError(f"{model.repo} arrived damaged: {names}; it was removed: try again")
    return folder


def describe(entries: Sequence[dict[str, Any]], console: Console) -> None:
    """Print name, licence, size and folder of every model."""
    for entry in entries:
        about = (f"  {entry['backend']}, {entry['licence']}", "dim")
        console.print(Text.assemble(entry["repo"], about))
        if entry["folder"]:
            console.print(f"  {entry['bytes_here'] / MEGABYTE:.0f} MB in {entry['folder']}")
        else:
            console.print(f"  not fetched, {_about(entry['about_mb'])}")


def _about(megabytes: int | None) -> str:
    return f"about {megabytes} MB" if megabytes else "size unknown"


def _document(model: KnownModel, folder: Path | None) -> dict[str, Any]:
    size = model_store.size_bytes(folder) if folder is not None else 0
    return {**asdict(model), "folder": str(folder or ""), "bytes_here": size}
