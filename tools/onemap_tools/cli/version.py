"""Which OneMap this is."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version


def version() -> str:
    """The version of the installed package; says so if only its sources are here."""
    try:
        return installed_version("onemap")
    except PackageNotFoundError:
        return "from sources that are not installed (pip install -e .)"
