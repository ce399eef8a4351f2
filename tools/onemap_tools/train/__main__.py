"""``python -m onemap_tools.train``: the same as ``onemap train``."""

from onemap_tools.train.commands import app

app()
