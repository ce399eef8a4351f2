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

# What three hours on two CPU cores have room for, with a margin: docs/encoders.md.
APARTMENTS = 750
PER_APARTMENT = 16
STEPS = 10_000  # about two hours on two CPU cores
SEED = 0
CONTINUED_LEARNING_RATE = 1.2e-3  # of weights that are trained already
CORES = os.cpu_count() or 1
EVALUATED = ("held_out", "other_style", "validation")
SHOWN_WORDS = 8  # those with the lowest R-precision

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
StartFrom = Annotated[
    Path | None,
    typer.Option(
        help="Folder of an earlier training's checkpoint to go on from, at a lower rate and with "
        "fixed statistics of the trunk's norms; not WORK/run, which is this one's."
    ),
]
Card = Annotated[bool, typer.Option("--card", help="Write MODEL_CARD.md from the figures.")]

DEFAULT_WORK = Path("runs/mini")


@app.command()
def mini(
    *,
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    steps: Steps = STEPS,
    seed: Seed = SEED,
    start_from: StartFrom = None,
    device: Device = "auto",
    threads: Threads = CORES,
) -> None:
    """All four steps, from nothing to weights and card; continues where it was stopped."""
    with _cli_errors():
        from onemap_tools.train import pipeline

        # Not only after a quarter of an hour of rendering.
        _check_start(work, start_from)
        pipeline.find_pretrained()
        pipeline.choose_device(device)
    render(work, output)
    train(
        work=work,
        output=output,
        steps=steps,
        seed=seed,
        start_from=start_from,
        device=device,
        threads=threads,
    )
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
    with _cli_errors():
        from onemap_tools.train import pipeline

        pipeline.render(_folders(work, output), apartments, per_apartment, processes)


@app.command()
def train(
    *,
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    steps: Steps = STEPS,
    seed: Seed = SEED,
    start_from: StartFrom = None,
    device: Device = "auto",
    threads: Threads = CORES,
) -> None:
    """Train on the rendered frames; continues from the last checkpoint."""
    with _cli_errors():
        from onemap_tools.train import pipeline
        from onemap_tools.train.params import TrainParams

        _check_start(work, start_from)
        params = TrainParams(steps=steps, seed=seed)
        if start_from is not None:
            update = {"start_from": start_from, "learning_rate": CONTINUED_LEARNING_RATE}
            params = params.model_copy(update=update)
        pipeline.train(_folders(work, output), params, device, threads)


@app.command()
def export(work: WorkFolder = DEFAULT_WORK, output: Output = None) -> None:
    """Write weights, embedding table and calibration; checks the weights against torch."""
    with _cli_errors():
        from onemap_tools.train import pipeline

        report = pipeline.export(_folders(work, output))
    typer.echo(f"exported; least cosine to torch {report.least_cosine:.6f}")
    if report.dropped_floor:
        typer.echo(
            f"the floor {report.dropped_floor:g} was of the weights before and is dropped: "
            "'onemap bench queries --config' measures that of these"
        )


@app.command()
def evaluate(
    work: WorkFolder = DEFAULT_WORK,
    output: Output = None,
    card: Card = False,
    as_json: Json = False,
) -> None:
    """Measure the exported encoder on apartments outside the training set."""
    with _cli_errors():
        from onemap_tools.train import pipeline

        folders = _folders(work, output)
        if card:
            pipeline.training_rounds(folders)  # known before the minutes of the evaluation
        figures = pipeline.evaluate_encoder(folders)
        if card:
            pipeline.write_card(folders, figures)
    for line in summary_lines(figures):
        typer.echo(line, err=as_json)
    if as_json:
        typer.echo(json.dumps(figures))


def summary_lines(figures: dict[str, Any]) -> Iterator[str]:
    """Figures of an evaluation as text, one paragraph per set of frames."""
    yield f"encoder {figures['encoder_id']}"
    for name in EVALUATED:
        part = figures[name]
        yield f"{name}: {part['frames']} frames, {part['classes']} classes"
        yield (
            f"  pixel accuracy {part['pixel_accuracy']:.3f}  mIoU {part['miou']:.3f}  "
            f"calibration error {part['calibration_error']:.3f}"
        )
        best = part["best_answer"]
        yield (
            f"  best answers: calibration error {best['calibration_error']:.3f}  "
            f"sure {best['sure']:.3f}, of these wrong {best['wrong_of_sure']:.3f}"
        )
        detector = part["detector"]
        yield (
            f"  detector patches: precision {detector['precision']:.3f}  "
            f"recall {detector['recall']:.3f}"
        )
        for words in ("names", "held_out_aliases"):
            row = part[words]
            yield (
                f"  {words}: R-precision {row['r_precision']:.3f}  "
                f"AUROC {row['auroc_mean_over_words']:.3f}, pooled {row['auroc_pooled']:.3f}"
            )
            worst = list(row["r_precision_by_word"].items())[:SHOWN_WORDS]
            yield "    worst: " + ", ".join(f"{word} {value:.2f}" for word, value in worst)


def _check_start(work: Path, start_from: Path | None) -> None:
    """Refuse a folder without weights, and the one that this training writes to.

    Where that one has a checkpoint already, the training goes on from it, whatever it began with.
    """
    from onemap_tools.train.train_state import CHECKPOINT, read_checkpoint_rounds

    if start_from is None:
        return
    if start_from.resolve() == (work / "run").resolve():
        raise CliError(
            f"{start_from} is where this training writes to: move it, say to {work / 'first'}",
            EXIT_USAGE_ERROR,
        )
    if not (work / "run" / CHECKPOINT).exists():
        read_checkpoint_rounds(start_from)


def _folders(folder: Path, output: Path | None) -> TrainingFolders:
    from onemap_tools.train import pipeline

    return pipeline.TrainingFolders(folder, folder / "encoder" if output is None else output)


@contextmanager
def _cli_errors() -> Iterator[None]:
    """Turn foreseeable errors into a CliError."""
    try:
        with requires_extra("train", "Training"):
            yield
    except CliError:
        raise
    except Exception as problem:
        from safetensors import SafetensorError

        from onemap_perception.errors import BackendError
        from onemap_tools.train.pipeline import TrainingError

        foreseen = BackendError | TrainingError | ValueError | OSError | SafetensorError
        if not isinstance(problem, foreseen):
            raise
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
