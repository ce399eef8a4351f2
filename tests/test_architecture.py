"""The walls of the house, read from the imports. A broken wall fails here, with its place."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.structure import (
    ROOT,
    SERVICES,
    Module,
    camera_arithmetic,
    declared_twice,
    floors,
    folders,
    modules,
    own_lines,
    within,
)

SHELL = {"service", "__main__", "config"}  # may talk, read the clock, log; the rest computes
MAX_FUNCTION_LINES = 70
MAX_PARAMETERS = 6
MAX_FILE_LINES = 600

# A file that talks (bus, clock, threads, processes, network, environment) or touches files says so
# below its docstring, with the reason. Every other module computes only. ``service``, ``__main__``
# and ``config`` of a service may do both, and so may the tools.
TALKS = re.compile(r"^# Talks: .+\.$", re.MULTILINE)
FILES = re.compile(r"^# Touches files: .+\.$", re.MULTILINE)
HEAVY = {"torch", "cv2", "fastapi"}
# What shared code imports inside a function, where it is asked for.
OPTIONAL = {("onemap_shared.compression", "cv2"): "colour images as JPEG, on thin links"}
# Plain values that happen to be defined beside what talks.
VALUES = {
    "onemap_shared.transport.Counters",
    "onemap_shared.transport.Health",
    "onemap_shared.transport.RemoteError",
    "onemap_shared.config.ConfigError",
    "onemap_shared.runner.StartError",
    "onemap_shared.watchdog.LoopProgress",
}
IMPURE = {
    "anyio",
    "asyncio",
    "concurrent",
    "http",
    "httpx",
    "huggingface_hub",
    "logging",
    "multiprocessing",
    "onemap_shared.bus",
    "onemap_shared.clock",
    "onemap_shared.config",
    "onemap_shared.runner",
    "onemap_shared.text_embedding",
    "onemap_shared.transport",
    "onemap_shared.watchdog",
    "os",
    "queue",
    "random",
    "sdnotify",
    "select",
    "shutil",
    "signal",
    "socket",
    "subprocess",
    "sys",
    "tempfile",
    "threading",
    "time",
    "urllib.request",
    "warnings",
}
FILE_IMPORTS = {"os", "shutil", "tempfile"}  # who touches files may
FILE_CALLS = {
    "dump",
    "imread",
    "imwrite",
    "load",
    "mkdir",
    "read_bytes",
    "read_text",
    "rmdir",
    "save_file",
    "savez",
    "savez_compressed",
    "touch",
    "unlink",
    "write_bytes",
    "write_text",
}
ONLY_IN = {
    "zenoh": {"onemap_shared.bus", "onemap_ros2.network"},
    "msgpack": {"onemap_shared.wire"},
    "mcap": {"onemap_tools.recording.bag_file"},
    "fastapi": {"onemap_gateway.http", "onemap_gateway.service"},
    "starlette": {"onemap_gateway.http"},
    "mcp": {"onemap_gateway.http.agent_tools"},
    "uvicorn": {"onemap_gateway.connections", "onemap_gateway.service"},
    "embreex": {"onemap_simulator.rendering.ray_tracer"},
    "trimesh": {
        "onemap_simulator.scene.loading",
        "onemap_simulator.scene.scene_file",
    },
    "onnxruntime": {"onemap_perception.onnx"},
    "huggingface_hub": {
        "onemap_perception.model_store",
    },
    **{  # services wait, draw numbers and start threads through the clock that they are given
        name: {"onemap_shared.clock", "onemap.connection", "onemap_tools"}
        for name in ("concurrent", "random", "threading", "time", "uuid")
    },
    "queue": {"onemap_shared.bus", "onemap_shared.log", "onemap_tools"},
    "httpx": {"onemap.client", "onemap.connection", "onemap_perception.model_store"},
}
# What one package may import of another: the gateway sends the replies that the client reads.
DOORS = {"onemap_gateway": {"onemap.place_replies", "onemap.replies", "onemap.search_replies"}}
NEVER = {"pickle", "cPickle", "dill", "joblib", "shelve", "marshal"}


def declares(module: Module, what: re.Pattern[str]) -> bool:
    return bool(what.search(module.text))


def is_shell(module: Module) -> bool:
    return module.package == "onemap_tools" or module.name.split(".")[-1] in SHELL


def may_talk(module: Module) -> bool:
    return is_shell(module) or declares(module, TALKS)


def may_touch_files(module: Module) -> bool:
    return is_shell(module) or declares(module, FILES)


def foreign_packages(module: Module) -> set[str]:
    """Packages of ours that this module may not import."""
    if module.package == "onemap_tools":
        return set()
    if module.package == "onemap":
        return set(folders(ROOT)) - {"onemap"}
    return set(folders(ROOT)) - {"onemap_shared", module.package}


def broken_walls(root: Path) -> list[str]:
    """Every import that goes through a wall: file, line and which wall."""
    broken = []
    for module in modules(root):
        for name, line in module.imports:
            place = f"{module.path.relative_to(root)}:{line}: imports {name}: "
            broken += [place + wall for wall in walls_in_the_way(module, name)]
        if not may_touch_files(module):
            for call, line in file_calls(module):
                place = f"{module.path.relative_to(root)}:{line}: calls {call}: "
                broken.append(place + "reads or writes files and does not say so")
    return broken


def walls_in_the_way(module: Module, name: str) -> Iterator[str]:
    """Why this module may not import ``name``."""
    top = name.split(".", maxsplit=1)[0]
    allowed = any(within(name, door) for door in DOORS.get(module.package, ()))
    if top in foreign_packages(module) and not allowed:
        shared = "" if module.package == "onemap" else " and onemap_shared"
        yield f"{module.package} may import only itself{shared}"
    if top in NEVER:
        yield "no pickle, on the wire or on disk"
    if module.package == "onemap_shared" and top in HEAVY and (module.name, top) not in OPTIONAL:
        yield "onemap_shared stays light"
    scopes = ONLY_IN.get(top)
    if scopes and not any(within(module.name, scope) for scope in scopes):
        yield f"only {', '.join(sorted(scopes))} may"
    impure = name not in VALUES and any(within(name, scope) for scope in IMPURE)
    if impure and not may_talk(module) and not (top in FILE_IMPORTS and may_touch_files(module)):
        yield "a module computes or it talks, never both"


def file_calls(module: Module) -> Iterator[tuple[str, int]]:
    """Calls that read or write files, by name: ``path.read_text()``, ``np.load()``, ``open()``."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            opens = isinstance(node.func, ast.Name) and node.func.id == "open"
            if opens or name in FILE_CALLS:
                yield name or "open", node.lineno


def touches(module: Module) -> bool:
    """Whether it reads files, or changes them through the door for that."""
    door = "onemap_shared.atomic_file"
    return any(file_calls(module)) or any(within(name, door) for name, _ in module.imports)


def test_no_import_goes_through_a_wall() -> None:
    assert broken_walls(ROOT) == []


# Names by which files are changed, and modes in which they are opened for it.
FILE_CHANGES = {
    "mkdir", "rename", "rmdir", "symlink_to", "touch", "unlink", "write_bytes", "write_text",
}  # fmt: skip
CHANGING_MODES = set("wxa+")
# What services change files with; a recording is made by tools alone, and the sign for a process's
# supervisor lies in a folder of the system.
FILE_DOORS = {
    "onemap_shared.atomic_file",
    "onemap_shared.supervisor",
    "onemap_simulator.replay.recording",
}
NOTHING_KEPT = {
    ("onemap_mapper.storage.worlds", "rmdir"),  # an empty folder
    ("onemap_mapper.storage.map_file", "open"),  # a member of an archive
}


def file_changes(module: Module) -> Iterator[tuple[str, int]]:
    """Calls that change files, by name or by the mode in which a file is opened."""
    for node in ast.walk(module.tree):
        if not isinstance(node, ast.Call):
            continue
        named = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        plain = node.func.id if isinstance(node.func, ast.Name) else ""
        given = [*node.args, *(word.value for word in node.keywords if word.arg == "mode")]
        modes = [arg.value for arg in given if isinstance(arg, ast.Constant)]
        changing = any(isinstance(m, str) and len(m) < 4 and CHANGING_MODES & {*m} for m in modes)
        if named in FILE_CHANGES or ("open" in (named, plain) and changing):
            yield named or plain, node.lineno


def test_services_change_files_through_one_door() -> None:
    strays = [
        f"{module.path.relative_to(ROOT)}:{line} {call}"
        for module in modules(ROOT)
        if module.package not in ("onemap_tools", "onemap") and module.name not in FILE_DOORS
        for call, line in file_changes(module)
        if (module.name, call) not in NOTHING_KEPT
    ]
    assert strays == []


@pytest.mark.parametrize("code", ["p.write_text('x')", "open(p, 'ab')", "p.open(mode='r+b')"])
def test_a_file_that_is_changed_elsewhere_is_seen(code: str) -> None:
    assert list(file_changes(Module("x", Path("x.py"), ast.parse(code))))


def test_exemptions_are_needed() -> None:
    """A file that no longer talks, or no longer touches files, is no longer exempt."""
    idle = [
        module.name
        for module in modules(ROOT)
        if declares(module, TALKS)
        and not any(within(name, impure) for name, _ in module.imports for impure in IMPURE)
    ]
    assert idle == []
    untouched = [m.name for m in modules(ROOT) if declares(m, FILES) and not touches(m)]
    assert untouched == []


# A file, what it holds, and why that is refused.
MAPPER, PLANNER = "services/mapper/onemap_mapper/", "services/planner/onemap_planner/"
BREACHES = [
    (PLANNER + "x.py", "from onemap_mapper.fusion import fuse", "may import only itself"),
    ("shared/onemap_shared/x.py", "import torch", "stays light"),
    ("shared/onemap_shared/x.py", "import onemap_tools.cli.app", "only itself"),
    (
        "client/onemap/x.py",
        "from onemap_shared.messages import SearchState",
        "onemap may import only",
    ),
    (MAPPER + "x.py", "from onemap import Client", "only itself"),
    ("services/gateway/onemap_gateway/x.py", "from onemap import Client", "only itself"),
    (MAPPER + "service.py", "import zenoh", "only onemap_ros2.network, onemap_shared.bus may"),
    ("shared/onemap_shared/x.py", "import msgpack", "only onemap_shared.wire may"),
    (MAPPER + "service.py", "import time", "onemap_shared.clock, onemap_tools may"),
    (PLANNER + "motion/path.py", "from onemap_shared.transport import Bus", "computes or it talks"),
    (PLANNER + "motion/path.py", "def f():\n    import logging", "computes or it talks"),
    (MAPPER + "fusion.py", "import os", "computes or it talks"),
    (PLANNER + "motion/path.py", "def f(path):\n    path.write_text('')", "reads or writes files"),
    ("tools/onemap_tools/x.py", "import pickle", "no pickle"),
]


@pytest.mark.parametrize(("file", "code", "reason"), BREACHES)
def test_a_broken_wall_is_seen(file: str, code: str, reason: str, tmp_path: Path) -> None:
    path = tmp_path / file
    path.parent.mkdir(parents=True)
    path.write_text(code, encoding="utf-8")
    findings = {line.split(": ", 2)[2] for line in broken_walls(tmp_path)}
    assert any(reason in finding for finding in findings)


def test_functions_are_short() -> None:
    long = [
        f"{module.path.relative_to(ROOT)}:{node.lineno} {node.name}: {own_lines(node)} lines"
        for module in modules(ROOT)
        for node in module.functions
        if own_lines(node) > MAX_FUNCTION_LINES
    ]
    assert long == []


def test_functions_take_few_parameters() -> None:
    greedy = []
    for module in modules(ROOT):
        for node in module.functions:
            arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            names = [argument.arg for argument in arguments if argument.arg not in ("self", "cls")]
            # A command's parameters are its options: the interface, not a call.
            is_command = module.package == "onemap_tools" and bool(node.decorator_list)
            is_kernel = any("compiled" in ast.unparse(d) for d in node.decorator_list)
            if len(names) > MAX_PARAMETERS and not is_command and not is_kernel:
                greedy.append(f"{module.path.relative_to(ROOT)}:{node.lineno} {node.name}: {names}")
    assert greedy == []


def test_files_hold_one_subject() -> None:
    long = [
        f"{module.path.relative_to(ROOT)}: {len(module.text.splitlines())} lines"
        for module in modules(ROOT)
        if module.name != "onemap_shared.messages"  # one subject, many of it
        and len(module.text.splitlines()) > MAX_FILE_LINES
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
        for name, _ in module.imports
        if name.endswith(("Truth", "TruthRequest"))
    } | {
        module.package
        for module in modules(ROOT)
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Name | ast.Attribute)
        and (node.id if isinstance(node, ast.Name) else node.attr) == "ROBOT_TRUTH"
    }
    assert knows <= {"onemap_shared", "onemap_simulator", "onemap_tools"}


def test_nobody_but_the_camera_computes_with_its_focal_length() -> None:
    strays = camera_arithmetic(modules(ROOT))
    assert [name for name in strays if not within(name, "onemap_shared.camera")] == []


def test_a_setting_is_declared_once() -> None:
    assert declared_twice(modules(ROOT)) == []


def test_public_class_names_mean_one_thing() -> None:
    places = defaultdict(list)
    for module in modules(ROOT):
        for node in module.tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(module.name)
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


def test_no_other_pool_is_made() -> None:
    """One that does not watch its parent would leave processes behind."""
    named = {
        module.name
        for module in modules(ROOT)
        for node in ast.walk(module.tree)
        if isinstance(node, ast.alias) and node.name in ("ProcessPoolExecutor", "Pool")
    }
    assert named == {"onemap_tools.processes.worker_pool"}


# From low to high. Each layer imports itself and those before it. Other modules directly in the
# package (threads, bus, configuration) are the highest.
ORDERS = {
    "onemap_planner": ("sentences", "world", "motion", "search", "policy", "service"),
    "onemap_gateway": ("bus", "present", "config", "http", "service"),
}


def upward(module: Module) -> list[str]:
    """Imports of the module that point to a higher layer."""
    order = ORDERS[module.package]

    def layer(name: str) -> int:
        part = name.split(".")[1]
        return order.index(part) if part in order else len(order) - 1

    return [
        f"{module.name}:{line} imports {name}"
        for name, line in module.imports
        if within(name, module.package) and layer(name) > layer(module.name)
    ]


@pytest.mark.parametrize("package", ORDERS)
def test_nothing_imports_upwards_or_in_circles(package: str) -> None:
    inside = [m for m in modules(ROOT) if m.name.startswith(f"{package}.")]
    assert [broken for module in inside for broken in upward(module)] == []
    assert {m.name.split(".")[1] for m in inside} >= set(ORDERS[package])
    assert floors(package, modules(ROOT)) > 1  # raises if there is a circle
