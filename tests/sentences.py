"""Every sentence that the product says, read from its sources.

``python -m tests.sentences`` prints them, one a line with its place, to be read aloud.
"""

from __future__ import annotations

import ast
import html
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.structure import ROOT, modules

STATIC = ROOT / "services/gateway/onemap_gateway/static"
LEAST_WORDS = 4  # less is a label, or a part of something else
WORD = re.compile(r"[A-Za-z][A-Za-z'-]+")
SCRIPT_TEXT = re.compile(r'"((?:[^"\\\n]|\\.)*)"|`((?:[^`\\]|\\.)*)`')
PAGE_TEXT = re.compile(r'(?:title|aria-label|placeholder|alt)="([^"]+)"|>([^<>]+)<')
# Regular expressions, JSON examples, content policies, calls: text that nobody reads.
NOT_SAID = re.compile(
    r"\(\?|\\[bws]|^[{\[]\s*\"|'self'|^\(?[a-z-]+: |[=;{]$|=>|^\d+ \d+px|-> Tensor"
)
CODE = {"shared/onemap_shared/phrasing.py"}  # patterns


@dataclass(frozen=True, slots=True)
class Said:
    """A text with its place; what is filled in later stands in braces."""

    file: str
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.text}"


def sentences(least_words: int = LEAST_WORDS) -> list[Said]:
    """All texts of at least so many words, in the order of the sources."""
    return [
        said
        for said in (*_of_python(), *_of_the_page())
        if len(WORD.findall(re.sub(r"\{[^{}]*\}", "", said.text))) >= least_words
        and not NOT_SAID.search(said.text)
    ]


def _of_python() -> Iterator[Said]:
    for module in modules(ROOT):
        file = str(module.path.relative_to(ROOT))
        if file not in CODE:
            for node in _without_docstrings(module.tree):
                text = _text(node)
                if text is not None:
                    yield Said(file, node.lineno, text.strip())


def _without_docstrings(tree: ast.Module) -> Iterator[ast.expr]:
    """The outermost string expressions."""
    left: list[ast.AST] = [tree]
    while left:
        node = left.pop()
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue
        if isinstance(node, ast.Constant | ast.JoinedStr):
            yield node
        else:
            left += reversed(list(ast.iter_child_nodes(node)))


def _text(node: ast.expr) -> str | None:
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    assert isinstance(node, ast.JoinedStr)
    return "".join(
        str(part.value) if isinstance(part, ast.Constant) else "{…}" for part in node.values
    )


def _of_the_page() -> Iterator[Said]:
    for path in sorted((*STATIC.glob("*.js"), *STATIC.glob("*.html"))):
        pattern = SCRIPT_TEXT if path.suffix == ".js" else PAGE_TEXT
        text = _without_comments(path)
        for found in pattern.finditer(text):
            said = html.unescape(" ".join(next(filter(None, found.groups()), "").split()))
            said = re.sub(r"\$\{[^{}]*\}", "{…}", said)
            yield Said(str(path.relative_to(ROOT)), text.count("\n", 0, found.start()) + 1, said)


def _without_comments(path: Path) -> str:
    """The file, with as many lines."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".js":
        return re.sub(r"^\s*(//|/?\*).*$", "", text, flags=re.M)
    gone = re.compile(r"<(script|style)\b.*?</\1>|<!--.*?-->", re.S)
    return gone.sub(lambda found: "\n" * found[0].count("\n"), text)


if __name__ == "__main__":
    for each in sentences():
        print(each)
