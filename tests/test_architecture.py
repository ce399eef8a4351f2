"""The walls of the house, read from the imports. A broken wall fails here, with its place."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SERVICES = ("perception", "mapper", "planner", "gateway", "simulator")
SHELL = {"service", "__main__", "config"}  # may talk, read the clock, log; the rest computes
MAX_FUNCTION_LINES = 50
MAX_PARAMETERS = 6
MAX_FILE_LINES = 400

# Modules outside SHELL that talk, and why.
SHELL_MODULES = {
    "onemap_gateway": "the whole package is a door: HTTP on one side, the bus on the other",
    "onemap_tools": "what people start",
    "onemap_planner.planning_thread": "the thread that plans while the loop steers",
    "onemap_planner.registry": "what that thread, the loop and the bus's threads share",
    "onemap_mapper.text_cache": "a cache that the bus's threads share",
}
# Plain values that happen to be defined beside what talks.
VALUES = {"onemap_shared.transport.Counters", "onemap_shared.transport.Health"}
IMPURE = {
    "time",
    "logging",
    "random",
    "threading",
    "socket",
    "subprocess",
    "onemap_shared.bus",
    "onemap_shared.transport",
    "onemap_shared.runner",
    "onemap_shared.memory_bus",
}
ONLY_IN = {
    "zenoh": {"onemap_shared.bus"},
    "msgpack": {"onemap_shared.wire"},
    "fastapi": {"onemap_gateway"},
    "uvicorn": {"onemap_gateway"},
    "embreex": {"onemap_simulator"},
    "trimesh": {"onemap_simulator"},
    "onnxruntime": {"onemap_perception.onnx"},
}
NEVER = {"pickle", "cPickle", "dill", "joblib", "shelve", "marshal"}


@dataclass(frozen=True)
class Module:
    name: str
    path: Path
    tree: ast.Module

    @property
    def package(self) -> str:
        return self.name.split(".")[0]

    @property
    def is_shell(self) -> bool:
        named = self.package in SHELL_MODULES or self.name in SHELL_MODULES
        return named or self.name.split(".")[-1] in SHELL


def folders(root: Path) -> dict[str, Path]:
    """Where each package lies."""
    services = {f"onemap_{name}": root / "services" / name / f"onemap_{name}" for name in SERVICES}
    return {
        "onemap_shared": root / "shared" / "onemap_shared",
        "onemap_tools": root / "tools" / "onemap_tools",
        **services,
    }


def modules(root: Path) -> list[Module]:
    """Every module of the product below ``root``."""
    found = []
    for package, folder in folders(root).items():
        for path in sorted(folder.rglob("*.py")):
            parts = [package, *path.relative_to(folder).with_suffix("").parts]
            name = ".".join(part for part in parts if part != "__init__")
            found.append(Module(name, path, ast.parse(path.read_text(encoding="utf-8"))))
    return found


def imports(module: Module) -> Iterator[tuple[str, int]]:
    """Full names that a module imports, anywhere in it, with the line."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module.path}:{node.lineno}: relative import"
            for alias in node.names:
                yield f"{node.module}.{alias.name}", node.lineno


def within(name: str, scope: str) -> bool:
    return name == scope or name.startswith(scope + ".")


def foreign_packages(module: Module) -> set[str]:
    """Packages of ours that this module may not import."""
    ours = set(folders(ROOT))
    if module.package == "onemap_tools":
        return set()
    allowed = {"onemap_shared", module.package}
    return ours - allowed


def broken_walls(root: Path) -> list[str]:
    """Every import that goes through a wall: file, line and which wall."""
    broken = []
    for module in modules(root):
        for name, line in imports(module):
            top = name.split(".")[0]
            place = f"{module.path.relative_to(root)}:{line}: imports {name}: "
            if top in foreign_packages(module):
                broken.append(place + f"{module.package} may import only itself and onemap_shared")
            if top in NEVER:
                broken.append(place + "no pickle, on the wire or on disk")
            if module.package == "onemap_shared" and top in {"torch", "cv2", "fastapi"}:
                broken.append(place + "onemap_shared stays light")
            scopes = ONLY_IN.get(top)
            if scopes and not any(within(module.name, scope) for scope in scopes):
                broken.append(place + f"only {', '.join(sorted(scopes))} may")
            pure = module.package != "onemap_shared" and not module.is_shell
            if pure and name not in VALUES and any(within(name, impure) for impure in IMPURE):
                broken.append(place + "a module computes or it talks, never both")
    return broken


def functions(module: Module) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(module.tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def own_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring."""
    lines = (node.end_lineno or node.lineno) - node.lineno + 1
    if ast.get_docstring(node, clean=False) is not None:
        text = node.body[0]
        lines -= (text.end_lineno or text.lineno) - text.lineno + 1
    return lines


def test_no_import_goes_through_a_wall() -> None:
    assert broken_walls(ROOT) == []


BREACHES = {
    "service to service": (
        "services/planner/onemap_planner/x.py",
        "from onemap_mapper.fusion import fuse",
        "may import only itself",
    ),
    "shared to torch": ("shared/onemap_shared/x.py", "import torch", "stays light"),
    "shared to tools": ("shared/onemap_shared/x.py", "import onemap_tools.cli.app", "only itself"),
    "zenoh outside the bus": (
        "services/mapper/onemap_mapper/service.py",
        "import zenoh",
        "only onemap_shared.bus may",
    ),
    "msgpack outside the wire": (
        "shared/onemap_shared/x.py",
        "import msgpack",
        "only onemap_shared.wire may",
    ),
    "fastapi outside the gateway": (
        "services/mapper/onemap_mapper/service.py",
        "from fastapi import FastAPI",
        "only onemap_gateway may",
    ),
    "a clock in a pure module": (
        "services/mapper/onemap_mapper/fusion.py",
        "import time",
        "computes or it talks",
    ),
    "the bus in a pure module": (
        "services/planner/onemap_planner/motion/path.py",
        "from onemap_shared.transport import Bus",
        "computes or it talks",
    ),
    "an import inside a function": (
        "services/planner/onemap_planner/motion/path.py",
        "def f():\n    import logging",
        "computes or it talks",
    ),
    "pickle": ("tools/onemap_tools/x.py", "import pickle", "no pickle"),
}


@pytest.mark.parametrize("breach", BREACHES)
def test_a_broken_wall_is_seen(breach: str, tmp_path: Path) -> None:
    file, code, reason = BREACHES[breach]
    path = tmp_path / file
    path.parent.mkdir(parents=True)
    path.write_text(code, encoding="utf-8")
    (finding,) = {line.split(": ", 2)[2] for line in broken_walls(tmp_path)}
    assert reason in finding


def test_functions_are_short() -> None:
    long = [
        f"{module.path.relative_to(ROOT)}:{node.lineno} {node.name}: {own_lines(node)} lines"
        for module in modules(ROOT)
        for node in functions(module)
        if own_lines(node) > MAX_FUNCTION_LINES
    ]
    assert long == []


def test_functions_take_few_parameters() -> None:
    greedy = []
    for module in modules(ROOT):
        for node in functions(module):
            arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            names = [argument.arg for argument in arguments if argument.arg not in ("self", "cls")]
            # A command's parameters are its options: the interface, not a call.
            is_command = module.package == "onemap_tools" and bool(node.decorator_list)
            if len(names) > MAX_PARAMETERS and not is_command:
                greedy.append(f"{module.path.relative_to(ROOT)}:{node.lineno} {node.name}: {names}")
    assert greedy == []


def test_files_hold_one_subject() -> None:
    long = [
        f"{module.path.relative_to(ROOT)}: {len(module.path.read_text().splitlines())} lines"
        for module in modules(ROOT)
        if module.name != "onemap_shared.messages"  # one subject, many of it
        and len(module.path.read_text().splitlines()) > MAX_FILE_LINES
    ]
    assert long == []


def test_keys_are_written_in_one_place() -> None:
    """A bus key anywhere but in keys.py is a bug."""
    prefixes = ("robot/", "perception/", "map/", "search/", "health/")
    strays = [
        f"{module.path.relative_to(ROOT)}:{node.lineno} {node.value!r}"
        for module in modules(ROOT)
        if module.name != "onemap_shared.keys"
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and node.value.startswith(prefixes)
        and node.value.endswith(("/v1", "/*"))
    ]
    assert strays == []


def test_nothing_importable_lies_directly_in_a_service_folder() -> None:
    stray = [path for name in SERVICES for path in (ROOT / "services" / name).glob("*.py")]
    assert stray == []


def test_there_is_no_attic() -> None:
    assert [m.path for m in modules(ROOT) if m.name.split(".")[-1] in ("utils", "helpers")] == []


def test_no_service_but_the_simulator_knows_the_truth() -> None:
    knows = {
        module.package
        for module in modules(ROOT)
        for name, _ in imports(module)
        if name.endswith(("Truth", "TruthRequest"))
    } | {
        module.package
        for module in modules(ROOT)
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Name | ast.Attribute)
        and (node.id if isinstance(node, ast.Name) else node.attr) == "ROBOT_TRUTH"
    }
    assert knows <= {"onemap_shared", "onemap_simulator", "onemap_tools"}
