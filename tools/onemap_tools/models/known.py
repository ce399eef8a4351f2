"""Known models of the hub on this machine: list, fetch, verify."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
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
from onemap_perception.errors import ModelError
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

if TYPE_CHECKING:
    from rich.console import Console


MEGABYTE = 1e6


@dataclass(frozen=True, slots=True)
class ModelEntry:
    """A known model; ``folder`` is empty and ``bytes_here`` 0 if it is not on this machine."""

    model: model_store.KnownModel
    folder: str
    bytes_here: int

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        return {**asdict(self.model), "folder": self.folder, "bytes_here": self.bytes_here}


def inventory() -> list[ModelEntry]:
    """Every known model with its folder."""
    try:
        return [
            _entry(model, model_store.cached(model.repo, model.files))
            for model in model_store.KNOWN_MODELS
        ]
    except ModelError as problem:
        raise CliError(str(problem)) from problem


def fetch(repo: str, console: Console) -> ModelEntry:
    """Download and verify one model; raises CliError."""
    model = _known(repo)
    size = f"about {model.about_mb} MB" if model.about_mb else "size unknown"
    console.print(f"Fetching {repo} ({size}, licence {model.licence})")
    return _entry(model, download(model, console))


def download(model: model_store.KnownModel, console: Console) -> Path:
    """Fetch a model with a progress bar and verify it; CliError if it cannot be had whole."""
    columns = (BarColumn(), DownloadColumn(), TransferSpeedColumn(), TimeRemainingColumn())
    try:
        with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
            listing = model_store.look_up(model.repo, model.files)
            total = sum(file.size_bytes for file in listing.files if file.large)
            task = progress.add_task(model.repo, total=total)
            folder = model_store.fetch(listing, model.files, partial(progress.advance, task))
    except ModelError as problem:
        raise CliError(str(problem)) from problem
    damaged = model_store.corrupt_files(folder)
    if damaged:
        model_store.discard(folder, damaged)
        names = ", ".join(damaged)
        raise CliError(f"{model.repo} arrived damaged: {names}; it was removed: fetch again")
    return folder


def verify(repo: str) -> list[dict[str, Any]]:
    """Repo, folder and damaged files of one model, or of all on this machine without ``repo``."""
    if repo:
        _known(repo)
    entries = [entry for entry in inventory() if repo in ("", entry.model.repo)]
    if repo and not entries[0].folder:
        raise CliError(f"{repo} is not on this machine: onemap models fetch {repo}")
    return [
        {
            "repo": entry.model.repo,
            "folder": entry.folder,
            "damaged": model_store.corrupt_files(Path(entry.folder)),
        }
        for entry in entries
        if entry.folder
    ]


def describe(entries: Sequence[ModelEntry], console: Console) -> None:
    """Print name, licence, size and folder of every model."""
    for entry in entries:
        model = entry.model
        console.print(Text.assemble(model.repo, (f"  {model.backend}, {model.licence}", "dim")))
        if entry.folder:
            console.print(f"  {entry.bytes_here / MEGABYTE:.0f} MB in {entry.folder}")
        else:
            size = f"about {model.about_mb} MB" if model.about_mb else "size unknown"
            console.print(f"  not fetched, {size}")


def describe_reports(reports: Sequence[dict[str, Any]], console: Console) -> None:
    """Print whether each model is whole, or its damaged files."""
    if not reports:
        console.print("No known model lies on this machine.")
    for report in reports:
        bad = ", ".join(report["damaged"])
        state = f"damaged: {bad}; delete {report['folder']}" if bad else "whole"
        console.print(f"{report['repo']}: {state}")


def _known(repo: str) -> model_store.KnownModel:
    try:
        return model_store.known_model(repo)
    except ModelError as problem:
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem


def _entry(model: model_store.KnownModel, folder: Path | None) -> ModelEntry:
    if folder is None:
        return ModelEntry(model, "", 0)
    return ModelEntry(model, str(folder), model_store.size_bytes(folder))
