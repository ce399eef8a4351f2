"""``python -m onemap_tools`` is ``onemap``: what the launcher starts its children with."""

from onemap_tools.cli.app import main

main()
