"""``onemap models``: list and use models of the hub."""

from __future__ import annotations

from typing import Annotated

import typer

from onemap_tools.cli.options import Config, Json
from onemap_tools.cli.terminal import confirmed, print_json, progress_console, result_console
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra

app = typer.Typer(no_args_is_help=True, help="Encoders and detectors from the model hub.")


@app.command(name="list")
def list_models(as_json: Json = False) -> None:
    """Known models: licence, size and folder on this machine. Uses no network."""
    from onemap_tools.models import known

    entries = known.inventory()
    known.describe(entries, result_console(as_json))
    if as_json:
        print_json({"models": entries})


@app.command()
def use(
    names: Annotated[
        list[str],
        typer.Argument(
            help="An encoder (tipsv2, openclip_convnext), a detector (coco, "
            "open_vocabulary, routed), one of each, or hub ids of 'onemap models list'."
        ),
    ],
    *,
    device: Annotated[
        str, typer.Option(help="cpu, cuda or cuda:N; default: cuda if there is one.")
    ] = "",
    yes: Annotated[
        bool, typer.Option("--yes", help="Accept the licences without being asked.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Fetch models, check that they run here and print the configuration for them.

    Shows licence and size and asks; refuses a device with too little memory. The section
    perception is printed last, after the models were loaded and saw one image:
    'onemap models use tipsv2 | tee -a robot.yaml' adds it to a file that has none.
    """
    import yaml

    with requires_extra("transformers", "'onemap models use'"):
        from onemap_tools.models.setup import set_up

    console = progress_console()
    document = set_up(names, device, confirm=lambda: None if yes else _agree(), console=console)
    if document["note"]:
        console.print(document["note"], soft_wrap=True)
    lines = yaml.safe_dump({"perception": document["perception"]}, sort_keys=False)
    typer.echo(lines, nl=False, err=as_json)
    if as_json:
        print_json(document)


@app.command()
def calibrate(
    config: Config = None,
    apartments: Annotated[
        int, typer.Option(min=2, max=100, help="Those with odd seeds choose the floor.")
    ] = 10,
    as_json: Json = False,
) -> None:
    """Measure the floor of the configured encoder, below which a map answers with nothing.

    The lowest at which at most one unrelated word in twenty is answered, on maps of generated
    apartments; then how often answers are right, on others. It says nothing of photographs.
    """
    with requires_extra("demo", "A calibration"):
        from onemap_tools.models import calibration

    try:
        result = calibration.calibrate(config, apartments, progress_console().print)
    except ValueError as problem:
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem
    result_console(as_json).print(*calibration.lines(result), sep="\n", soft_wrap=True)
    if as_json:
        print_json(result)


def _agree() -> None:
    """Ask for the licences; CliError unless the user agrees."""
    answer = confirmed("Accept the licences and fetch the models?")
    if answer is None:
        raise CliError(
            "Licences are accepted on a terminal, which this is not: read them, then give --yes.",
            EXIT_USAGE_ERROR,
        )
    if not answer:
        raise CliError("Not accepted: nothing was fetched.")
