"""All generated pages, by file name."""

from __future__ import annotations

from pathlib import Path

from onemap_tools.cli.config_report import installed_models, schema
from onemap_tools.docs.messages_page import messages_page
from onemap_tools.docs.settings_page import settings_page
from onemap_tools.errors import CliError

ROOT = Path(__file__).resolve().parents[3]


def generated_pages() -> dict[str, str]:
    """File name in ``docs/`` to text; CliError if the models of a section are not installed."""
    models = installed_models()
    if models.missing:
        raise CliError("\n".join(models.missing.values()))
    return {"messages.md": messages_page(), "settings.md": settings_page(schema(models), ROOT)}
