"""The configuration file of ``onemap models use``: read, changed in memory, replaced at the end."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from onemap_mapper.storage.map_file import replacing
from onemap_perception.config import PerceptionConfig
from onemap_shared.config import read, section
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.model_setup.choice import ModelChoice, perception_section
from onemap_tools.model_setup.config_text import with_section

NO_ENVIRONMENT: Mapping[str, str] = {}


@dataclass(frozen=True, slots=True)
class ConfigDraft:
    """A file's text as it is and as it is to be. perception: the section of ``after``."""

    path: Path
    before: str
    after: str
    perception: PerceptionConfig


def draft(path: Path, choice: ModelChoice, device: str, *, allow_remote_code: bool) -> ConfigDraft:
    """The file with the chosen models; nothing is written. A file that is missing is empty.

    Raises CliError or ConfigError if it cannot be read, changed or, later, written.
    """
    check_writable(path)
    before = _text(path)
    sections = read(path if path.exists() else None, NO_ENVIRONMENT)
    section(sections, "perception", PerceptionConfig)
    wanted = perception_section(
        sections.get("perception", {}), choice, device, allow_remote_code=allow_remote_code
    )
    config = section({"perception": wanted}, "perception", PerceptionConfig)
    return ConfigDraft(
        path, before, with_section(before, "perception", wanted, source=str(path)), config
    )


def check_writable(path: Path) -> None:
    """CliError unless the file can be replaced; leaves nothing behind."""
    target = path.resolve()
    if target.is_dir():
        raise CliError(f"{path} is a folder; name a file", EXIT_USAGE_ERROR)
    if not target.parent.is_dir():
        raise CliError(f"{path} cannot be written: there is no folder {target.parent}")
    if target.exists() and not os.access(target, os.W_OK):
        raise CliError(f"{path} cannot be written: it is read-only")
    probe = target.with_name(f".{target.name}.{os.getpid()}.probe")
    try:
        probe.touch(exist_ok=False)
        probe.unlink()
    except OSError as problem:
        reason = problem.strerror or problem
        raise CliError(f"{path} cannot be written: {target.parent}: {reason}") from problem


def write(drafted: ConfigDraft) -> None:
    """Replace the file as a whole, with its permissions; CliError if it changed meanwhile."""
    target = drafted.path.resolve()
    if _text(drafted.path) != drafted.before:
        raise CliError(
            f"{drafted.path} was changed by somebody else meanwhile and is left as it is; "
            "the models are fetched: run the command again"
        )
    try:
        with replacing(target) as file:
            if target.exists():
                os.fchmod(file.fileno(), target.stat().st_mode & 0o7777)
            file.write(drafted.after.encode("utf-8"))
    except OSError as problem:
        reason = problem.strerror or problem
        raise CliError(f"{drafted.path} cannot be written: {reason}") from problem


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return ""
    except (OSError, UnicodeDecodeError) as problem:
        raise CliError(f"cannot read {path}: {problem}", EXIT_USAGE_ERROR) from problem
