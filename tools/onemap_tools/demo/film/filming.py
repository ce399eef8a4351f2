"""Records a search and writes its film when it ends, however it ends."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from onemap_shared.transport import Bus
from onemap_tools.demo.film.film_file import write_film
from onemap_tools.demo.film.recorder import FilmRecorder
from onemap_tools.errors import EXIT_INTERRUPTED, CliError


@contextmanager
def filming(path: Path, bus: Bus, console: Console) -> Iterator[FilmRecorder]:
    """A recorder to update during the search; afterwards the film is written to ``path``.

    Also after an error, but not after Ctrl-C, and not if there was never a map to show.
    """
    recorder = FilmRecorder(bus)
    interrupted = False
    try:
        yield recorder
    except CliError as error:
        interrupted = error.exit_code == EXIT_INTERRUPTED
        raise
    finally:
        if not interrupted:
            recorder.end(time.monotonic())
            _write(path, recorder, console)


def _write(path: Path, recorder: FilmRecorder, console: Console) -> None:
    if not recorder.moments:
        console.print("No film: there was no map and camera image while the search ran.")
        return
    console.print(f"Drawing the film of {len(recorder.moments)} pictures")
    facts = write_film(path, recorder.moments)
    console.print(
        f"Film: {path} ({facts.pictures} pictures, {facts.length_s:.1f} s, "
        f"{facts.bytes / 1e6:.1f} MB)",
        soft_wrap=True,
    )
