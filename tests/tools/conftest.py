"""What the tests of the command line share."""

from __future__ import annotations

from functools import cache

import typer.testing
from typer.main import get_command

# Typer builds its hundred commands anew at every call, which takes most of a call's time.
typer.testing._get_command = cache(get_command)  # type: ignore[attr-defined]
