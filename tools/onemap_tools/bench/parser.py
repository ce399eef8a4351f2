"""The options of a benchmark."""

from __future__ import annotations

import argparse
from typing import NoReturn

from onemap_tools.errors import EXIT_USAGE_ERROR, CliError


class Parser(argparse.ArgumentParser):
    """Tells what is wrong as every command does."""

    def error(self, message: str) -> NoReturn:
        """Raise CliError."""
        raise CliError(f"{self.prog}: {message}", EXIT_USAGE_ERROR)
