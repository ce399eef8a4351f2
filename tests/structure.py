"""The structure of the sources, read from their syntax trees, and its figures.

``python -m tests.structure [CHECKOUT]`` prints the figures of this or another checkout as JSON.
"""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from statistics import median
from typing import Any

ROOT = Path(__file__).parents[1]
SERVICES = ("perception", "mapper", "planner", "gateway", "simulator", "ros2")
COUNTED = {
    **{name: f"services/{name}" for name in ("mapper", "planner", "gateway")},
    "tools": "tools",
}
CAMERA_FIELDS = {"fx", "fy", "cx", "cy"}
PARAMS_BASES = ("Params", "StrictModel", "Config")  # ends of the names of parameter models
PLAIN_TYPES = {"bool", "float", "int", "str", "tuple", "Path", "F64"}


@dataclass(frozen=True, eq=False)
class Module:
    """A source file: dotted name, path, syntax tree."""

    name: str
    path: Path
    tree: ast.Module

    @cached_property
    def text(self) -> str:
        return self.path.read_text(encoding="utf-8")

    @property
    def package(self) -> str:
        return self.name.split(".")[0]

    @cached_property
    def imports(self) -> tuple[tuple[str, int], ...]:
        """Full names that the module imports, anywhere in it, with the line."""
        found = []
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Import):
                found += [(alias.name, node.lineno) for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{self.path}:{node.lineno}: relative import"
                found += [(f"{node.module}.{alias.name}", node.lineno) for alias in node.names]
        return tuple(found)

    @property
    def functions(self) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
        for node in ast.walk(self.tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield node

    @property
    def classes(self) -> Iterator[ast.ClassDef]:
        yield from (node for node in ast.walk(self.tree) if isinstance(node, ast.ClassDef))


def folders(root: Path) -> dict[str, Path]:
    """Where each package lies."""
    services = {f"onemap_{name}": root / "services" / name / f"onemap_{name}" for name in SERVICES}
    return {
        "onemap": root / "client" / "onemap",
        "onemap_shared": root / "shared" / "onemap_shared",
        "onemap_tools": root / "tools" / "onemap_tools",
        **services,
    }


@cache
def modules(root: Path) -> list[Module]:
    """Every module of the product below ``root``."""
    found = []
    for package, folder in folders(root).items():
        for path in sorted(folder.rglob("*.py")):
            parts = [package, *path.relative_to(folder).with_suffix("").parts]
            name = ".".join(part for part in parts if part != "__init__")
            found.append(Module(name, path, ast.parse(path.read_text(encoding="utf-8"))))
    return found


def within(name: str, scope: str) -> bool:
    """Whether a dotted name is ``scope`` or lies in it."""
    return name == scope or name.startswith(scope + ".")


def own_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring."""
    lines = (node.end_lineno or node.lineno) - node.lineno + 1
    if ast.get_docstring(node, clean=False) is not None:
        text = node.body[0]
        lines -= (text.end_lineno or text.lineno) - text.lineno + 1
    return lines


def floors(package: str, sources: list[Module]) -> int:
    """Modules on the longest chain of imports inside a package; raises if there is a circle."""
    names = {module.name for module in sources if within(module.name, package)}
    below = {
        module.name: {
            own
            for name, _ in module.imports
            for own in (name, name.rpartition(".")[0])
            if own in names and own != module.name
        }
        for module in sources
        if module.name in names
    }
    height: dict[str, int] = {}

    def climb(name: str, path: tuple[str, ...]) -> int:
        assert name not in path, f"import circle: {' -> '.join((*path, name))}"
        if name not in height:
            height[name] = 1 + max((climb(n, (*path, name)) for n in below[name]), default=0)
        return height[name]

    return max(climb(name, ()) for name in names)


def declared_twice(sources: list[Module]) -> list[str]:
    """Plain settings: fields of a parameter model that a dataclass of the same package repeats.

    Only dataclasses that repeat three or more, and at least half of their fields, count: others
    share a name by chance.
    """
    found = []
    for package in folders(ROOT):
        classes = [c for module in sources if module.package == package for c in module.classes]
        settings = {
            field for c in classes if _is_params(c) and not _is_dataclass(c) for field in _fields(c)
        }
        for c in classes:
            fields = _fields(c)
            repeated = [f for f, kind in fields.items() if f in settings and kind in PLAIN_TYPES]
            if _is_dataclass(c) and len(repeated) >= 3 and 2 * len(repeated) >= len(fields):
                found += [f"{package}: {c.name}.{field}" for field in repeated]
    return found


def camera_arithmetic(sources: list[Module]) -> list[str]:
    """Functions that compute with the focal length or the principal point of a camera."""
    found = set()
    for module in sources:
        for function in module.functions:
            for node in ast.walk(function):
                if isinstance(node, ast.BinOp) and any(
                    isinstance(part, ast.Attribute) and part.attr in CAMERA_FIELDS
                    for part in (node.left, node.right)
                ):
                    found.add(f"{module.name}.{function.name}")
    return sorted(found)


def _fields(node: ast.ClassDef) -> dict[str, str]:
    """Names of the annotated fields of a class, with their type, without its arguments."""
    return {
        part.target.id: ast.unparse(part.annotation).split("[")[0].split(" |")[0]
        for part in node.body
        if isinstance(part, ast.AnnAssign)
        and isinstance(part.target, ast.Name)
        and "ClassVar" not in ast.unparse(part.annotation)
    }


def _is_params(node: ast.ClassDef) -> bool:
    return any(isinstance(b, ast.Name) and b.id.endswith(PARAMS_BASES) for b in node.bases)


def _is_dataclass(node: ast.ClassDef) -> bool:
    return any("dataclass" in ast.unparse(decorator) for decorator in node.decorator_list)


def lines_below(folders_: Iterable[Path]) -> int:
    """Lines of all Python files below these folders."""
    files = {path for folder in folders_ for path in folder.rglob("*.py")}
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files)


def words(root: Path) -> int:
    """Words in README, CHANGELOG, CONTRIBUTING, docs and deploy."""
    pages = [*root.glob("*.md"), *root.glob("docs/**/*.md"), *root.glob("deploy/**/*.md")]
    return sum(len(page.read_text(encoding="utf-8").split()) for page in pages)


def settings(root: Path) -> list[str]:
    """Keys that users can set, by their full path; sections do not count."""
    command = "from onemap_tools.cli.app import main; main()"
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(str(folder.parent) for folder in folders(root).values())
    }
    output = subprocess.run(
        [sys.executable, "-c", command, "config", "schema", "--json"],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    schema = json.loads(output.splitlines()[-1])
    found: set[str] = set()

    def collect(path: str, entry: dict[str, Any]) -> None:
        choices = entry.get("oneOf") or entry.get("anyOf") or [entry]
        models = [
            schema["$defs"][c["$ref"].rpartition("/")[2]] if "$ref" in c else c for c in choices
        ]
        sections = [model for model in models if "properties" in model]
        if not sections:
            found.add(path)
        for section in sections:
            for name, inner in section["properties"].items():
                collect(f"{path}.{name}" if path else name, inner)

    collect("", schema)
    return sorted(found)


def goals(root: Path) -> dict[str, int]:
    """The sizes that have a limit: see CONTRIBUTING.md."""
    outside = [
        root / name for name in ("client", "shared", "services", "tools", "deploy", "examples")
    ]
    files = {name: len(list((root / path).rglob("*.py"))) for name, path in COUNTED.items()}
    return {
        "python_lines_outside_tests": lines_below(outside),
        "python_lines_of_tests": lines_below([root / "tests"]),
        "words_of_documents": words(root),
        "settings": len(settings(root)),
        **{f"files_{name}": count for name, count in files.items()},
    }


def figures(root: Path) -> dict[str, object]:
    """Sizes and counts of a checkout's sources."""
    sources = modules(root)
    lengths = [own_lines(function) for module in sources for function in module.functions]
    rays = [n for n in camera_arithmetic(sources) if not n.startswith("onemap_shared.")]
    lines = [len(module.text.splitlines()) for module in sources]
    return {
        **goals(root),
        "files": len(sources),
        "lines": sum(lines),
        "median_lines_of_a_file": median(line for line in lines if line > 1),
        "functions": len(lengths),
        "median_lines_of_a_function": median(lengths),
        "most_files_in_one_folder": max(
            sum(module.path.parent == folder for module in sources)
            for folder in {module.path.parent for module in sources}
        ),
        "planner_import_floors": floors("onemap_planner", sources),
        "settings_declared_twice": len(declared_twice(sources)),
        "functions_that_compute_with_fx_outside_shared": len(rays),
    }


if __name__ == "__main__":
    print(json.dumps(figures(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT), indent=2))
