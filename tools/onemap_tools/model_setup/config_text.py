"""Rewrites one section of a configuration file: comments and all other lines stay."""

from __future__ import annotations

import difflib
import io
import re
from collections.abc import Mapping
from typing import Any

import yaml
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.error import YAMLError
from ruamel.yaml.util import load_yaml_guess_indent

from onemap_shared.params import is_secret
from onemap_tools.errors import CliError

LINE_CHARS = 4096  # longer lines are folded; a person's are shorter
DEFAULT_INDENT = 2
NESTED = re.compile(r"^( +)[\w-]+:")
KEY = re.compile(r"^(\s*)([\w-]+):")


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
