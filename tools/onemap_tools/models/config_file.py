"""The configuration file of ``onemap models use``: one section of it is replaced."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import yaml

from onemap_perception.config import PerceptionConfig
from onemap_shared.atomic_file import replacing
from onemap_shared.config import read, section
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.models.choice import ModelChoice, perception_section

SECTION = "perception"
# From its key to the next line that begins a section, a comment before that, or the end.
BLOCK = re.compile(rf"^{SECTION}:.*\n(?:[ \t].*\n|\n(?=[ \t]))*", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class ConfigDraft:
    """A file's text as it is and as it is to be, and its new section."""

    path: Path
    before: str
    after: str
    section: Mapping[str, Any]
    perception: PerceptionConfig


def draft(path: Path, choice: ModelChoice, device: str) -> ConfigDraft:
    """The file with the chosen models; nothing is written. A file that is missing is empty.

    Raises CliError or ConfigError if it cannot be read, changed or, later, written.
    """
    check_writable(path)
    sections = read(path if path.exists() else None, {})
    before = path.read_text(encoding="utf-8") if path.exists() else ""
    section(sections, SECTION, PerceptionConfig)
    wanted = perception_section(sections.get(SECTION, {}), choice, device)
    config = section({SECTION: wanted}, SECTION, PerceptionConfig)
    return ConfigDraft(path, before, with_section(before, wanted, path), wanted, config)


def check_writable(path: Path) -> None:
    """CliError unless the file can be replaced; leaves nothing behind."""
    target = path.resolve()
    if target.is_dir():
        raise CliError(f"{path} is a folder; name a file", EXIT_USAGE_ERROR)
    if target.exists() and not os.access(target, os.W_OK):
        raise CliError(f"{path} cannot be written: it is read-only")
    try:
        TemporaryFile(dir=target.parent).close()
    except OSError as problem:
        raise CliError(
            f"{path} cannot be written: {target.parent}: {problem.strerror}"
        ) from problem


def write(drafted: ConfigDraft) -> None:
    """Replace the file as a whole, with its permissions."""
    target = drafted.path.resolve()
    try:
        with replacing(target) as file:
            if target.exists():
                os.fchmod(file.fileno(), target.stat().st_mode & 0o7777)
            file.write(drafted.after.encode("utf-8"))
    except OSError as problem:
        raise CliError(f"{drafted.path} cannot be written: {problem.strerror}") from problem


def with_section(text: str, wanted: Mapping[str, Any], path: Path) -> str:
    """The YAML ``text`` with another section, whose comments go; CliError where it is not alone.

    The result is read again: it holds the other sections as they were, and this one as it is given.
    """
    before = yaml.safe_load(text) or {}
    if before.get(SECTION) == dict(wanted):
        return text
    lines = yaml.safe_dump({SECTION: dict(wanted)}, sort_keys=False)
    whole = text if not text or text.endswith("\n") else f"{text}\n"
    written, count = BLOCK.subn(lambda _: lines, whole)
    written = written if count else whole + lines
    try:
        kept = yaml.safe_load(written) == {**before, SECTION: dict(wanted)}
    except yaml.YAMLError:
        kept = False
    if count > 1 or not kept:
        raise CliError(
            f"{path} is written in a way that cannot be changed without losing some of it; "
            f"write this section into it yourself:\n{lines.strip()}"
        )
    return written
