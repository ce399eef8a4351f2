"""``onemap bench`` and ``onemap train``."""

from __future__ import annotations

import typer

PANEL = "Look deeper"
bench_app = typer.Typer(no_args_is_help=True, help="Measure on this machine.")
train_app = typer.Typer(no_args_is_help=True, help="Train what ships.")
