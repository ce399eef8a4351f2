"""``onemap train``: render, train, export, evaluate, or ``mini`` for all of them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from onemap_tools.cli.command_group import CommandGroup
from onemap_tools.cli.options import Json
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra

if TYPE_CHECKING:
    from onemap_tools.train.pipeline import TrainingFolders

app = typer.Typer(
    cls=CommandGroup, no_args_is_help=True, help="Train an encoder like the shipped one."
)

# Of the shipped encoder.
APARTMENTS = 600
PER_APARTMENT = 20
STEPS = 10_000  # about two hours on two CPU cores
SEED = 0
CORES = os.cpu_count() or 1

WorkFolder = Annotated[Path, typer.Option(help="Folder for frames and checkpoints.")]
Output = Annotated[Path | None, typer.Option(help="Folder for the encoder; default: WORK/encoder.")]
Apartments = Annotated[int, typer.Option(min=1, max=9000, help="Apartments to train on.")]
PerApartment = Annotated[int, typer.Option(min=2, max=1000, help="Images of each.")]
Processes = Annotated[int, typer.Option(min=1, max=256, help="Processes that render.")]
Steps = Annotated[
    int, typer.Option(min=1, help="Training steps on crops; a tenth more follow on whole images.")
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of everything random.")]
Device = Annotated[str, typer.Option(help="cpu, cuda, or auto: cuda where there is one.")]
Threads = Annotated[int, typer.Option(min=1, max=256, help="CPU threads of torch.")]
Card = Annotated[bool, typer.Option("--card", help="Write MODEL_CARD.md from the figures.")]

DEFAULT_WORK = Path("runs/mini")


@app.command()
def mini(
    *,
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    steps: Steps = STEPS,
    seed: Seed = SEED,
    device: Device = "auto",
    threads: Threads = CORES,
) -> None:
    """All four steps, from nothing to weights and card; continues where it was stopped."""
    with _pipeline() as pipeline:
        # Not only after a quarter of an hour of rendering.
        pipeline.find_pretrained()
        pipeline.choose_device(device)
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
    """Render training and held-out frames; continues an interrupted rendering."""
    with _pipeline() as pipeline:
        pipeline.render(_folders(work, output), apartments, per_apartment, processes)


@app.command()
def train(
    *,
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    steps: Steps = STEPS,
    seed: Seed = SEED,
    device: Device = "auto",
    threads: Threads = CORES,
) -> None:
    """Train on the rendered frames; continues from the last checkpoint."""
    with _pipeline() as pipeline:
        params = pipeline.TrainParams(steps=steps, seed=seed)
        pipeline.train(_folders(work, output), params, device, threads)


@app.command()
def export(work: WorkFolder = DEFAULT_WORK, output: Output = None) -> None:
    """Write weights, embedding table and calibration; checks the weights against torch."""
    with _pipeline() as pipeline:
        least_cosine, dropped_floor = pipeline.export(_folders(work, output))
    typer.echo(f"exported; least cosine to torch {least_cosine:.6f}")
    if dropped_floor:
        typer.echo(
            f"the floor {dropped_floor:g} was of the weights before and is dropped: "
            "'onemap models calibrate --config' measures that of these"
        )


@app.command()
def evaluate(
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    card: Card = False,
    as_json: Json = False,
) -> None:
    """Measure the exported encoder on apartments outside the training set."""
    with _pipeline() as pipeline:
        folders = _folders(work, output)
        if card:
            pipeline.training_record(folders)  # known before the minutes of the evaluation
        figures = pipeline.evaluate_encoder(folders)
        if card:
            pipeline.write_card(folders, figures)
        from onemap_tools.train.model_card import figures_table
    typer.echo(f"encoder {figures['encoder_id']}\n{figures_table(figures)}", err=as_json)
    if as_json:
        typer.echo(json.dumps(figures))


def _folders(folder: Path, output: Path | None) -> TrainingFolders:
    from onemap_tools.train import pipeline

    return pipeline.TrainingFolders(folder, folder / "encoder" if output is None else output)


@contextmanager
def _pipeline() -> Iterator[Any]:
    """The module, which is slow to import; turns foreseeable errors into a CliError."""
    try:
        with requires_extra("train", "Training"):
            from onemap_tools.train import pipeline

            yield pipeline
    except (ValueError, OSError) as problem:
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
    except Exception as problem:
        from safetensors import SafetensorError

        from onemap_perception.errors import BackendError

        if not isinstance(problem, BackendError | SafetensorError):
            raise
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
