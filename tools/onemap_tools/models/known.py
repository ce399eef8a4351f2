"""Known models of the hub on this machine: list, fetch, verify."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.progress import (
    BarColumn,
    DownloadColumn,
    Progress,
    TimeRemainingColumn,
    TransferSpeedColumn,
)
from rich.text import Text

from onemap_perception import model_store
from onemap_perception.errors import BackendError
from onemap_tools.errors import EXIT_FAILED, EXIT_USAGE_ERROR, CliError

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
            _document(model, model_store.cached(model.repo, model.files))
            for model in model_store.KNOWN_MODELS
        ]


def fetch(repo: str, console: Console) -> dict[str, Any]:
    """Download and verify one model; raises CliError."""
    with model_errors(EXIT_USAGE_ERROR):
        model = model_store.known_model(repo)
    size = _about(model.about_mb)
    console.print(f"Fetching {repo} ({size}, licence {model.licence})")
    return _document(model, download(model, console))


def download(model: model_store.KnownModel, console: Console) -> Path:
    """Fetch a model with a progress bar and verify it; CliError if it cannot be had whole."""
    columns = (BarColumn(), DownloadColumn(), TransferSpeedColumn(), TimeRemainingColumn())
    shown = Progress(*columns, console=console, disable=not console.is_terminal)
    with model_errors(), shown as progress:
        listing = model_store.look_up(model.repo, model.files)
        total = sum(file.size_bytes for file in listing.files if file.large)
        task = progress.add_task(model.repo, total=total)
        folder = model_store.fetch(listing, model.files, partial(progress.advance, task))
    damaged = model_store.corrupt_files(folder)
    if damaged:
        model_store.discard(folder, damaged)
        names = ", ".join(damaged)
        raise CliError(f"{model.repo} arrived damaged: {names}; it was removed: fetch again")
    return folder


def verify(repo: str) -> list[dict[str, Any]]:
    """Repo, folder and damaged files of one model, or of all on this machine without ``repo``."""
    if repo:
        with model_errors(EXIT_USAGE_ERROR):
            model_store.known_model(repo)
    entries = [entry for entry in inventory() if repo in ("", entry["repo"]) and entry["folder"]]
    if repo and not entries:
        raise CliError(f"{repo} is not on this machine: onemap models fetch {repo}")
    return [
        {
            "repo": entry["repo"],
            "folder": entry["folder"],
            "damaged": model_store.corrupt_files(Path(entry["folder"])),
        }
        for entry in entries
    ]


def describe(entries: Sequence[dict[str, Any]], console: Console) -> None:
    """Print name, licence, size and folder of every model."""
    for entry in entries:
        about = (f"  {entry['backend']}, {entry['licence']}", "dim")
        console.print(Text.assemble(entry["repo"], about))
        if entry["folder"]:
            console.print(f"  {entry['bytes_here'] / MEGABYTE:.0f} MB in {entry['folder']}")
        else:
            console.print(f"  not fetched, {_about(entry['about_mb'])}")


def describe_reports(reports: Sequence[dict[str, Any]], console: Console) -> None:
    """Print whether each model is whole, or its damaged files."""
    if not reports:
        console.print("No known model lies on this machine.")
    for report in reports:
        bad = ", ".join(report["damaged"])
        state = f"damaged: {bad}; delete {report['folder']}" if bad else "whole"
        console.print(f"{report['repo']}: {state}")


def _about(megabytes: int | None) -> str:
    return f"about {megabytes} MB" if megabytes else "size unknown"


def _document(model: model_store.KnownModel, folder: Path | None) -> dict[str, Any]:
    size = model_store.size_bytes(folder) if folder is not None else 0
    return {**asdict(model), "folder": str(folder or ""), "bytes_here": size}
