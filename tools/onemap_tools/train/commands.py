"""``onemap train``: make an encoder like the shipped one, and measure it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from onemap_tools.cli.command_group import CommandGroup
from onemap_tools.cli.options import Json
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra

app = typer.Typer(
    cls=CommandGroup, no_args_is_help=True, help="Train an encoder like the shipped one."
)

# Of the shipped encoder.
APARTMENTS = 600
STEPS = 10_000  # about two hours on two CPU cores
SEED = 0
CORES = os.cpu_count() or 1

WorkFolder = Annotated[Path, typer.Option(help="Folder for frames and checkpoints.")]
Output = Annotated[Path | None, typer.Option(help="Folder for the encoder; default: WORK/encoder.")]
Apartments = Annotated[int, typer.Option(min=1, max=9000, help="Apartments to train on.")]
Steps = Annotated[
    int, typer.Option(min=1, help="Training steps on crops; a tenth more follow on whole images.")
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of everything random.")]
Device = Annotated[str, typer.Option(help="cpu, cuda, or auto: cuda where there is one.")]
Cores = Annotated[
    int, typer.Option(min=1, max=256, help="Processes that render, then threads that train.")
]

DEFAULT_WORK = Path("runs/mini")


@app.command()
def mini(
    *,
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    apartments: Apartments = APARTMENTS,
    steps: Steps = STEPS,
    seed: Seed = SEED,
    device: Device = "auto",
    cores: Cores = CORES,
) -> None:
    """Render, train, export and evaluate; continues where it was stopped."""
    with _pipeline() as pipeline:
        # Not only after a quarter of an hour of rendering.
        pipeline.find_pretrained()
        pipeline.choose_device(device)
        pipeline.render(work, apartments, cores)
        pipeline.train(work, pipeline.TrainParams(steps=steps, seed=seed), device, cores)
        least_cosine = pipeline.export(work, output or work / "encoder")
    typer.echo(f"exported; least cosine to torch {least_cosine:.6f}")
    evaluate(work, output)


@app.command()
def evaluate(work: WorkFolder = DEFAULT_WORK, output: Output = None, as_json: Json = False) -> None:
    """Measure the exported encoder on apartments outside the training set."""
    with _pipeline() as pipeline:
        figures = pipeline.evaluate_encoder(work, output or work / "encoder")
        from onemap_tools.train.evaluation import figures_table
    typer.echo(f"encoder {figures['encoder_id']}\n{figures_table(figures)}", err=as_json)
    if as_json:
        typer.echo(json.dumps(figures))


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
        from onemap_perception.errors import BackendError

        if not isinstance(problem, BackendError):
            raise
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
