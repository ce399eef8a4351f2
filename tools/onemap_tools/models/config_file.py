"""The configuration file of ``onemap models use``: read, changed in memory, replaced at the end."""

from __future__ import annotations

import difflib
import io
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import yaml
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.error import YAMLError
from ruamel.yaml.util import load_yaml_guess_indent

from onemap_perception.config import PerceptionConfig
from onemap_shared.atomic_file import replacing
from onemap_shared.config import read, section
from onemap_shared.params import is_secret
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.models.choice import ModelChoice, perception_section

LINE_CHARS = 4096  # longer lines are folded; a person's are shorter
DEFAULT_INDENT = 2
NESTED = re.compile(r"^( +)[\w-]+:")
KEY = re.compile(r"^(\s*)([\w-]+):")


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
    sections = read(path if path.exists() else None, {})
    section(sections, "perception", PerceptionConfig)
    wanted = perception_section(
        sections.get("perception", {}), choice, device, allow_remote_code=allow_remote_code
    )
    config = section({"perception": wanted}, "perception", PerceptionConfig)
    after = with_section(before, "perception", wanted, source=str(path))
    return ConfigDraft(path, before, after, config)


def check_writable(path: Path) -> None:
    """CliError unless the file can be replaced; leaves nothing behind."""
    target = path.resolve()
    if target.is_dir():
        raise CliError(f"{path} is a folder; name a file", EXIT_USAGE_ERROR)
    if not target.parent.is_dir():
        raise CliError(f"{path} cannot be written: there is no folder {target.parent}")
    if target.exists() and not os.access(target, os.W_OK):
        raise CliError(f"{path} cannot be written: it is read-only")
    try:
        TemporaryFile(dir=target.parent).close()
    except OSError as problem:
        raise CliError(
            f"{path} cannot be written: {target.parent}: {problem.strerror}"
        ) from problem


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
        raise CliError(f"{drafted.path} cannot be written: {problem.strerror}") from problem


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return ""
    except (OSError, UnicodeDecodeError) as problem:
        raise CliError(f"cannot read {path}: {problem}", EXIT_USAGE_ERROR) from problem


def with_section(text: str, name: str, section: Mapping[str, Any], *, source: str) -> str:
    """The YAML ``text`` with another section ``name``; raises CliError if that is not possible.

    Comments stay, but for those beside a line that goes. The result is read again: it holds the
    other sections as they were, and this one as it is given.
    """
    before = yaml.safe_load(text) or {}
    try:
        written = _rewritten(text, name, section)
        kept = yaml.safe_load(written) == {**before, name: dict(section)}
    except (YAMLError, yaml.YAMLError, ValueError):
        kept = False
    if not kept:
        lines = yaml.safe_dump({name: dict(section)}, sort_keys=False).strip()
        raise CliError(
            f"{source} is written in a way that cannot be changed without losing some of it; "
            f"write this section into it yourself:\n{lines}"
        )
    return written


def _rewritten(text: str, name: str, section: Mapping[str, Any]) -> str:
    writer = YAML()
    writer.preserve_quotes = True
    writer.width = LINE_CHARS
    document, sequence, offset = load_yaml_guess_indent(text, yaml=writer)
    nested = [len(found[1]) for line in text.splitlines() if (found := NESTED.match(line))]
    mapping = min(nested, default=DEFAULT_INDENT)
    if offset is None:  # no list to learn from
        sequence, offset = mapping, 0
    writer.indent(mapping=mapping, sequence=sequence, offset=offset)
    if document is None:
        # A file of comments only: nothing holds them, so they are put before the new section.
        comments = text.rstrip() + "\n" if text.strip() else ""
        return comments + _dumped(writer, {name: dict(section)})
    if not isinstance(document.get(name), CommentedMap):
        document[name] = CommentedMap()
    _update(document[name], section)
    return _dumped(writer, document)


def _dumped(writer: YAML, document: Any) -> str:
    out = io.StringIO()
    writer.dump(document, out)
    return out.getvalue()


def _update(node: CommentedMap, values: Mapping[str, Any]) -> None:
    """Make the node hold these values, touching only what differs."""
    for key in [key for key in node if key not in values]:
        del node[key]
    for key, value in values.items():
        if isinstance(value, Mapping) and isinstance(node.get(key), CommentedMap):
            _update(node[key], value)
        elif key not in node or node[key] != value:
            node[key] = value


def changed_lines(before: str, after: str) -> list[str]:
    """Lines that went (``- ...``) and came (``+ ...``); the values of secrets are stars."""
    old, new = before.splitlines(), after.splitlines()
    lines = []
    for kind, a, b, c, d in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if kind != "equal":
            lines += [f"- {_masked(line)}" for line in old[a:b]]
            lines += [f"+ {_masked(line)}" for line in new[c:d]]
    return lines


def _masked(line: str) -> str:
    found = KEY.match(line)
    return f"{found[0]} ***" if found and is_secret(found[2]) else line
