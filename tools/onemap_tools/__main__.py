"""``python -m onemap_tools`` is ``onemap``: what the launcher starts its children with.

A service is started without the other commands, whose import takes as long as a small service's.
"""

import sys
from pathlib import Path

from onemap_shared.services import SERVICES
from onemap_tools.errors import CliError
from onemap_tools.processes.services import run

match sys.argv[1:]:
    case [name, "--config", file] if name in SERVICES:
        try:
            sys.exit(run(name, Path(file)))
        except CliError as problem:
            print(problem, file=sys.stderr)
            sys.exit(problem.exit_code)
    case _:
        from onemap_tools.cli.app import main

        main()
