"""``onemap train``: render, train, export, evaluate, or ``mini`` for all of them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from onemap_tools.cli.command_group import CommandGroup
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

if TYPE_CHECKING:
    from onemap_tools.train.pipeline import TrainingFolders

app = typer.Typer(
    cls=CommandGroup, no_args_is_help=True, help="Train an encoder as the one that ships."
)

APARTMENTS = 600
PER_APARTMENT = 20
CORES = os.cpu_count() or 1
STEPS = 10_000

WorkFolder = Annotated[Path, typer.Option(help="Folder for frames and checkpoints.")]
Output = Annotated[Path | None, typer.Option(help="Where the encoder goes; default: WORK/encoder.")]
Apartments = Annotated[int, typer.Option(min=1, max=9000, help="Apartments to train on.")]
PerApartment = Annotated[int, typer.Option(min=2, max=1000, help="Pictures of each.")]
Processes = Annotated[int, typer.Option(min=1, max=256, help="Processes to render with.")]
Steps = Annotated[
    int, typer.Option(min=1, help="Steps of 24 crops; a tenth more on whole pictures.")
]
Seed = Annotated[int, typer.Option(min=0, help="Everything random follows from it.")]
Device = Annotated[str, typer.Option(help="cpu, cuda, or auto: cuda where there is one.")]
Threads = Annotated[int, typer.Option(min=1, max=256, help="CPU threads to train with.")]
Card = Annotated[bool, typer.Option("--card", help="Write MODEL_CARD.md from the figures.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object as the last line.")]

DEFAULT_WORK = Path("runs/mini")


@app.command()
def mini(
    *,
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    steps: Steps = STEPS,
    seed: Seed = 0,
    device: Device = "auto",
    threads: Threads = CORES,
) -> None:
    """All four steps, with the sizes that the shipped encoder was made with."""
    render(work, output)
    train(work=work, output=output, steps=steps, seed=seed, device=device, threads=threads)
    export(work, output)
    evaluate(work, output, card=True)


@app.command()
def render(
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    apartments: Apartments = APARTMENTS,
    per_apartment: PerApartment = PER_APARTMENT,
    processes: Processes = CORES,
) -> None:
    """Render training and held-out frames; goes on where it stopped."""
    with _cli_errors():
        from onemap_tools.train import pipeline

        pipeline.render(_folders(work, output), apartments, per_apartment, processes)


@app.command()
def train(
    *,
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    steps: Steps = STEPS,
    seed: Seed = 0,
    device: Device = "auto",
    threads: Threads = CORES,
) -> None:
    """Train on the rendered frames; goes on from the last checkpoint."""
    with _cli_errors():
        import torch

        from onemap_tools.train import pipeline
        from onemap_tools.train.memory import keep_freed_memory
        from onemap_tools.train.trainer import TrainParams

        keep_freed_memory()
        torch.set_num_threads(threads)
        automatic = "cuda" if torch.cuda.is_available() else "cpu"
        chosen = torch.device(automatic if device == "auto" else device)
        pipeline.train(_folders(work, output), TrainParams(steps=steps, seed=seed), chosen)


@app.command()
def export(work: WorkFolder = DEFAULT_WORK, output: Output = None) -> None:
    """Write weights, words and calibration; refused unless they agree with torch."""
    with _cli_errors():
        from onemap_tools.train import pipeline

        cosine = pipeline.export(_folders(work, output))
    typer.echo(f"exported; least cosine to torch {cosine:.6f}")


@app.command()
def evaluate(
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    card: Card = False,
    as_json: AsJson = False,
) -> None:
    """Measure the exported encoder on apartments that were never trained on."""
    with _cli_errors():
        from onemap_tools.train import pipeline
        from onemap_tools.train.summary import lines

        figures = pipeline.evaluate_encoder(_folders(work, output))
        if card:
            pipeline.write_card(_folders(work, output), figures)
    for line in lines(figures):
        typer.echo(line, err=as_json)
    if as_json:
        typer.echo(json.dumps(figures))


def _folders(folder: Path, output: Path | None) -> TrainingFolders:
    from onemap_tools.train import pipeline

    return pipeline.TrainingFolders(folder, folder / "encoder" if output is None else output)


@contextmanager
def _cli_errors() -> Iterator[None]:
    """A user's mistake ends with one sentence, not with a traceback."""
    try:
        yield
    except ImportError as problem:
        raise CliError(
            f"{problem}; training needs: pip install 'onemap[train]'", EXIT_USAGE_ERROR
        ) from problem
    except Exception as problem:
        from onemap_perception.encoders.protocol import EncoderError
        from onemap_tools.train.pipeline import TrainingError

        if not isinstance(problem, EncoderError | TrainingError | ValueError):
            raise
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
