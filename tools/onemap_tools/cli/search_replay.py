"""``onemap search replay``: the decisions of a recorded search, step by step."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onemap_tools.cli.options import Json

PANEL = "Ask a running robot"
app = typer.Typer()

EPILOG = (
    "The planner records the last 50 searches in the folder 'decisions' of planner.state_dir, one "
    "file each. To search for an object called replay: onemap search -- replay"
)


@app.command(name="search replay", rich_help_panel=PANEL, epilog=EPILOG)
def search_replay(
    file: Annotated[Path, typer.Argument(help="A file of recorded decisions (*.jsonl).")],
    *,
    show_all: Annotated[bool, typer.Option("--all", help="Print all steps without waiting.")] = (
        False
    ),
    as_json: Json = False,
) -> None:
    """Why did the robot drive there? Each decision of a past search; Enter shows the next.

    Needs no running robot. Without a terminal all steps are printed.
    """
    from onemap_tools.cli.decision_file import decisions_document, describe_step, read_decisions
    from onemap_tools.cli.terminal import print_json, result_console, wait_for_enter

    decisions = read_decisions(file)
    if as_json:
        print_json(decisions_document(decisions))
        return
    console = result_console(as_json)
    count = len(decisions.steps)
    for number, step in enumerate(decisions.steps, 1):
        console.print(*describe_step(step, number, count), sep="\n", soft_wrap=True)
        last = number == count
        if not (last or show_all or wait_for_enter("Enter: next step, Ctrl-D: end ")):
            return
    if decisions.cut_off:
        console.print("The last line is not complete: the planner was ended while it wrote.")
