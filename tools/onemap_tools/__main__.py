"""``python -m onemap_tools`` is ``onemap``: what the launcher starts its children with.

A service, or the router, is started without the other commands, whose import takes as long as a
small service's.
"""

import sys
from pathlib import Path

from onemap_shared.config import ConfigError
from onemap_shared.services import SERVICES
from onemap_tools.errors import CliError, to_cli_error
from onemap_tools.processes import router, services

match sys.argv[1:]:
    case [name, "--config", file] if name in ("router", *SERVICES):
        try:
            if name == "router":
                router.run(Path(file), (), None)
            else:
                services.run(name, Path(file))
        except (ConfigError, CliError) as cause:
            problem = to_cli_error(cause)
            print(problem, file=sys.stderr)
            sys.exit(problem.exit_code)
    case _:
        from onemap_tools.cli.app import main

        main()
