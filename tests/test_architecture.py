"""The walls of the house, read from the imports. A broken wall fails here, with its place."""

from __future__ import annotations

import ast
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
    folders,
    modules,
    own_lines,
    within,
)

SHELL = {"service", "__main__", "config"}  # may talk, read the clock, log; the rest computes
MAX_FUNCTION_LINES = 50
MAX_PARAMETERS = 6
MAX_FILE_LINES = 400

# Files that talk (bus, clock, threads, processes, network, environment), each with its reason.
# Every other module computes only. ``service``, ``__main__`` and ``config`` of a service may.
TALKS = {
    "onemap.client": "takes another HTTP transport",
    "onemap.connection": "HTTP",
    "onemap.remote_search": "waits before it connects again",
    "onemap.standing_queries": "waits before it connects again",
    "onemap_shared.bus": "Zenoh",
    "onemap_shared.membership": "Zenoh's liveliness tokens",
    "onemap_shared.frame_sender": "sends from a thread",
    "onemap_shared.long_start": "publishes from a thread",
    "onemap_shared.memory_bus": "the bus inside one process",
    "onemap_shared.transport": "inboxes between the bus's threads and a service",
    "onemap_shared.log_limit": "a filter of the log",
    "onemap_shared.runner": "the process around a worker",
    "onemap_shared.tracing": "reads the clock, sends spans from a thread",
    "onemap_shared.watchdog": "watches the process from a thread",
    "onemap_shared.config": "reads files and the environment",
    "onemap_shared.text_embedding": "a call on the bus",
    "onemap_perception.detector_runner": "runs the detector beside the encoder",
    "onemap_perception.hub": "asks the model hub",
    "onemap_perception.hub_download": "HTTP",
    "onemap_perception.model_store": "asks the model hub and its cache",
    "onemap_perception.onnx": "tells onnxruntime through the environment to be quiet",
    "onemap_perception.text.text_encoder": "a cache that threads share",
    "onemap_mapper.checkpoints": "writes in a thread, and logs",
    "onemap_mapper.image_cache": "a cache that the bus's threads share",
    "onemap_mapper.map_queries": "asks perception for embeddings",
    "onemap_mapper.map_robot": "a robot of the map on the bus",
    "onemap_mapper.map_scores": "lets the bus's threads score a map in turn",
    "onemap_mapper.object_keeper": "answers the bus's threads",
    "onemap_mapper.pose_graph_follower": "moves submaps for a limited time, and logs",
    "onemap_mapper.preparation": "says on the bus and in the log that it compiles",
    "onemap_mapper.saved_maps": "answers on the bus, and logs",
    "onemap_mapper.text_cache": "a cache that the bus's threads share",
    "onemap_planner.find_outbox": "calls the mapper",
    "onemap_planner.search_commands": "answers the bus's threads",
    "onemap_planner.view_requests": "calls the mapper",
    "onemap_planner.planning_thread": "the thread that plans while the loop steers",
    "onemap_planner.registry": "what that thread, the loop and the bus's threads share",
    "onemap_gateway.bus.rpc": "calls on the bus from asynchronous code",
    "onemap_gateway.bus.state_cache": "follows the bus",
    "onemap_gateway.connections": "ends connections",
    "onemap_gateway.http.context": "the clock that routes read",
    "onemap_gateway.http.events": "waits between two events",
    "onemap_gateway.http.listener": "the socket",
    "onemap_gateway.http.methods": "ends an answer after its headers",
    "onemap_gateway.http.middleware": "logs and times requests",
    "onemap_gateway.http.queries": "asks for several texts at once",
    "onemap_gateway.http.query_events": "waits between two answers",
    "onemap_gateway.http.sockets": "notices that a client left",
    "onemap_gateway.http.problems": "turns errors of calls into responses",
    "onemap_gateway.http.agents.server": "logs what agents did",
    "onemap_gateway.http.agents.tools": "draws in a thread",
    "onemap_gateway.http.routes.agents": "imports the protocol's SDK in a thread",
    "onemap_gateway.http.routes.camera": "encodes in a thread",
    "onemap_gateway.http.routes.live": "waits between two states",
    "onemap_gateway.http.routes.map": "draws in a thread",
    "onemap_gateway.http.shared_results": "computes in tasks, a few at once",
    "onemap_gateway.http.security": "reads a request's body, and the clock for the lock-out",
    "onemap_tools.bag.record": "records from the bus until it is stopped",
    "onemap_tools.bag.recorder": "follows the bus",
    "onemap_tools.bag.replay": "reads the configuration",
    "onemap_ros2.display.display": "asks the mapper, in a thread",
    "onemap_ros2.discovery": "counts messages for a while",
    "onemap_ros2.network.bridge": "answers the robot's network from its threads",
    "onemap_ros2.network.rmw": "the robot's network, with its clock",
    "onemap_ros2.network.zenoh_session": "the robot's own Zenoh session",
    "onemap_tools.bench.claims": "times, in processes of its own",
    "onemap_tools.bench.clients": "times, in threads",
    "onemap_tools.bench.commands": "reads the configuration",
    "onemap_tools.bench.foreign_command": "reads the configuration",
    "onemap_tools.bench.fusion": "times",
    "onemap_tools.bench.image_queries_command": "reads the configuration",
    "onemap_tools.bench.machine": "times",
    "onemap_tools.bench.map_image": "times",
    "onemap_tools.bench.map_views": "times",
    "onemap_tools.bench.query_time": "the cores and the load",
    "onemap_tools.bench.query_waits": "times, in threads",
    "onemap_tools.bench.habitat.benchmark": "times",
    "onemap_tools.bench.habitat.lockstep_robot": "a bus inside one process",
    "onemap_tools.bench.habitat.robot": "a robot on the bus",
    "onemap_tools.bench.navigation.benchmark": "times, in processes of its own",
    "onemap_tools.bench.navigation.process_run": "runs the services",
    "onemap_tools.bench.perception": "times",
    "onemap_tools.bench.planning": "times",
    "onemap_tools.bench.pose_graph": "times",
    "onemap_tools.bench.occupancy_command": "reads the configuration",
    "onemap_tools.bench.ros2": "times",
    "onemap_tools.bench.scene": "times",
    "onemap_tools.bench.verdicts_command": "reads the configuration",
    "onemap_tools.bench.transport.benchmark": "runs processes, and times",
    "onemap_tools.bench.transport.link_process": "passes packets on",
    "onemap_tools.bench.transport.network": "makes network namespaces",
    "onemap_tools.bench.transport.peers": "processes on the bus",
    "onemap_tools.cli.command_group": "the command line",
    "onemap_tools.cli.config_report": "reads the configuration",
    "onemap_tools.cli.models": "reads the configuration",
    "onemap_tools.cli.ros2": "reads the configuration",
    "onemap_tools.cli.run": "passes an argument on through the environment",
    "onemap_tools.cli.terminal": "standard output",
    "onemap_tools.demo.film.filming": "reads the clock",
    "onemap_tools.demo.film.recorder": "follows a run on the bus",
    "onemap_tools.demo.ros2.robot": "runs the simulator, and reads the environment",
    "onemap_tools.demo.ros2.robot_bus": "a bus over another network",
    "onemap_tools.demo.run": "runs a demo",
    "onemap_tools.demo.run_monitor": "follows a run on the bus",
    "onemap_tools.demo.setup": "reads the configuration and the environment",
    "onemap_tools.doctor.observe": "listens on the bus",
    "onemap_tools.doctor.report": "reads the configuration",
    "onemap_tools.export.onnx_file": "silences warnings of the exporter",
    "onemap_tools.model_setup.config_file": "reads the configuration",
    "onemap_tools.model_setup.setup": "looks how full the disk is",
    "onemap_tools.processes.heartbeat": "listens on the bus",
    "onemap_tools.processes.interrupts": "signals",
    "onemap_tools.processes.launch": "starts processes",
    "onemap_tools.processes.network": "ports",
    "onemap_tools.processes.process_group": "signals processes and waits for them",
    "onemap_tools.processes.router": "runs the router",
    "onemap_tools.processes.services": "runs a service",
    "onemap_tools.processes.session": "joins the bus",
    "onemap_tools.processes.up": "supervises processes",
    "onemap_tools.processes.worker_pool": "processes that end with their parent",
    "onemap_tools.viewers.live": "serves a viewer until it is stopped",
    "onemap_tools.viewers.live_viewer": "follows the bus",
    "onemap_tools.train.commands": "sets threads through the environment",
    "onemap_tools.train.data.batches": "makes batches in a thread",
    "onemap_tools.train.pipeline": "times, copies files, sets up the allocator",
    "onemap_tools.train.trainer": "times its steps",
}
# Files that read or write files, each with what.
FILES = {
    "onemap_perception.factory": "entry points of installed packages",
    "onemap_perception.encoders.checkpoint": "weights",
    "onemap_perception.encoders.mini": "weights, words, calibration",
    "onemap_perception.encoders.openclip_convnext": "weights",
    "onemap_perception.hub_download": "weights",
    "onemap_perception.model_store": "weights",
    "onemap_perception.text.embedding_table": "words",
    "onemap_perception.text.calibration": "calibration",
    "onemap_perception.text.vocabulary": "vocabulary",
    "onemap_mapper.atomic_file": "what is written in one piece",
    "onemap_mapper.checkpoint_file": "checkpoints",
    "onemap_mapper.map_folder": "maps",
    "onemap_mapper.object_file": "found objects",
    "onemap_planner.search.decision_log": "the decisions of searches",
    "onemap_planner.search.journal": "the active search",
    "onemap_gateway.token_files": "tokens",
    "onemap_gateway.present.views": "an archive in memory",
    "onemap_simulator.replay.recorder": "recordings",
    "onemap_simulator.replay.recording": "recordings",
    "onemap_simulator.scene.corrections": "the YAML beside a scene",
    "onemap_simulator.scene.scene_file": "scenes",
    "onemap_shared.config": "the configuration",
    "onemap_tools.bag.bag_file": "recordings",
    "onemap_tools.bench.habitat.benchmark": "tables",
    "onemap_tools.bench.habitat.episode_files": "episodes",
    "onemap_tools.bench.navigation.results_folder": "results",
    "onemap_tools.bench.perception": "results",
    "onemap_tools.bench.place_labels": "labels",
    "onemap_tools.bench.pose_graph": "pictures",
    "onemap_tools.bench.scene_folder": "a document and pictures",
    "onemap_tools.bench.verdicts": "finished apartments",
    "onemap_tools.bench.transport.streams": "frames for its processes",
    "onemap_tools.certificate_files": "certificates",
    "onemap_tools.cli.crop_file": "a picture",
    "onemap_tools.cli.decision_file": "the decisions of a search",
    "onemap_tools.cli.floor_plan": "a picture",
    "onemap_tools.cli.map": "has the gateway load a map",
    "onemap_tools.cli.map_export": "a map",
    "onemap_tools.cli.scene": "a scene",
    "onemap_tools.cli.scene_report": "a folder",
    "onemap_tools.demo.film.film_file": "a film",
    "onemap_tools.demo.picture": "a picture",
    "onemap_tools.demo.run": "the summary",
    "onemap_tools.demo.setup": "the run's configuration",
    "onemap_tools.export.mini": "weights",
    "onemap_tools.export.onnx_file": "weights",
    "onemap_tools.export.tower": "weights",
    "onemap_tools.foreign.contact_sheet": "pictures",
    "onemap_tools.model_setup.config_file": "the configuration",
    "onemap_tools.model_setup.config_text": "YAML in memory",
    "onemap_tools.model_setup.memory": "the limit of a container",
    "onemap_tools.processes.launch": "logs",
    "onemap_tools.viewers.rerun_export": "the folder of the file",
    "onemap_tools.train.data.frame_dataset": "frames",
    "onemap_tools.train.network.backbone": "weights",
    "onemap_tools.train.pipeline": "everything that training leaves",
    "onemap_tools.train.rounds": "what weights were trained with",
    "onemap_tools.train.trainer": "checkpoints and a log",
}
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
    "onemap_shared.config",
    "onemap_shared.memory_bus",
    "onemap_shared.runner",
    "onemap_shared.text_embedding",
    "onemap_shared.tracing",
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
FILE_IMPORTS = {"os", "shutil", "tempfile"}  # FILES may
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
    "zenoh": {"onemap_shared.bus", "onemap_shared.membership", "onemap_ros2.network"},
    "msgpack": {"onemap_shared.wire"},
    "mcap": {"onemap_tools.bag.bag_file"},
    "foxglove": {
        "onemap_tools.viewers.foxglove_messages",
        "onemap_tools.viewers.foxglove_scenes",
        "onemap_tools.viewers.foxglove_server",
        "onemap_tools.viewers.foxglove_topics",
    },
    "rerun": {"onemap_tools.viewers.rerun_entities", "onemap_tools.viewers.rerun_export"},
    "opentelemetry": {"onemap_shared.tracing"},
    "fastapi": {"onemap_gateway.http", "onemap_gateway.service"},
    "starlette": {"onemap_gateway.http"},
    "mcp": {"onemap_gateway.http.agents.server"},
    "uvicorn": {"onemap_gateway.connections", "onemap_gateway.service"},
    "embreex": {"onemap_simulator.rendering.ray_tracer"},
    "trimesh": {
        "onemap_simulator.scene.mesh_texture",
        "onemap_simulator.scene.scene_file",
        "onemap_tools.foreign.scene_export",
    },
    "onnxruntime": {"onemap_perception.onnx"},
    "huggingface_hub": {
        "onemap_perception.hub",
        "onemap_perception.hub_download",
        "onemap_perception.model_store",
    },
    "httpx": {"onemap.client", "onemap.connection", "onemap_perception.hub_download"},
}
NEVER = {"pickle", "cPickle", "dill", "joblib", "shelve", "marshal"}


def may_talk(module: Module) -> bool:
    return module.name in TALKS or module.name.split(".")[-1] in SHELL


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
        if module.name not in FILES and module.name.split(".")[-1] not in SHELL:
            for call, line in file_calls(module):
                place = f"{module.path.relative_to(root)}:{line}: calls {call}: "
                broken.append(place + "reads or writes files, which only FILES may")
    return broken


def walls_in_the_way(module: Module, name: str) -> Iterator[str]:
    """Why this module may not import ``name``."""
    top = name.split(".", maxsplit=1)[0]
    if top in foreign_packages(module):
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
    if impure and not may_talk(module) and not (top in FILE_IMPORTS and module.name in FILES):
        yield "a module computes or it talks, never both"


def file_calls(module: Module) -> Iterator[tuple[str, int]]:
    """Calls that read or write files, by name: ``path.read_text()``, ``np.load()``, ``open()``."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            opens = isinstance(node.func, ast.Name) and node.func.id == "open"
            if opens or name in FILE_CALLS:
                yield name or "open", node.lineno


def test_no_import_goes_through_a_wall() -> None:
    assert broken_walls(ROOT) == []


def test_exemptions_are_needed() -> None:
    """A file that no longer talks, or no longer touches files, is no longer exempt."""
    known = {module.name: module for module in modules(ROOT)}
    idle = [
        name
        for name in TALKS
        if name not in known
        or not any(within(n, i) for n, _ in known[name].imports for i in IMPURE)
    ]
    assert idle == []
    untouched = [n for n in FILES if n not in known or not list(file_calls(known[n]))]
    assert untouched == []


BREACHES = {
    "service to service": (
        "services/planner/onemap_planner/x.py",
        "from onemap_mapper.fusion import fuse",
        "may import only itself",
    ),
    "shared to torch": ("shared/onemap_shared/x.py", "import torch", "stays light"),
    "shared to tools": ("shared/onemap_shared/x.py", "import onemap_tools.cli.app", "only itself"),
    "the client to shared": (
        "client/onemap/x.py",
        "from onemap_shared.messages import SearchState",
        "onemap may import only itself",
    ),
    "a service to the client": (
        "services/mapper/onemap_mapper/x.py",
        "from onemap import Client",
        "only itself",
    ),
    "zenoh outside the bus": (
        "services/mapper/onemap_mapper/service.py",
        "import zenoh",
        "only onemap_ros2.network, onemap_shared.bus, onemap_shared.membership may",
    ),
    "msgpack outside the wire": (
        "shared/onemap_shared/x.py",
        "import msgpack",
        "only onemap_shared.wire may",
    ),
    "fastapi outside the gateway": (
        "services/mapper/onemap_mapper/service.py",
        "from fastapi import FastAPI",
        "only onemap_gateway.http, onemap_gateway.service may",
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
    "the environment in a pure module": (
        "services/mapper/onemap_mapper/fusion.py",
        "import os",
        "computes or it talks",
    ),
    "a pool of threads in a pure module": (
        "services/perception/onemap_perception/variance.py",
        "from concurrent.futures import ThreadPoolExecutor",
        "computes or it talks",
    ),
    "the model hub in an encoder": (
        "services/perception/onemap_perception/encoders/mini.py",
        "from huggingface_hub import hf_hub_download",
        "only onemap_perception.hub, onemap_perception.hub_download, onemap_perception.model_store",
    ),
    "a file written in a pure module": (
        "services/planner/onemap_planner/motion/path.py",
        "def f(path):\n    path.write_text('')",
        "reads or writes files",
    ),
    "the bus in a pure module of the tools": (
        "tools/onemap_tools/doctor/checks.py",
        "from onemap_shared.transport import Bus",
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


# Tests of several modules at once, each with what they share.
ACROSS_MODULES = {
    "mapper/test_crossings.py": "between host and device, of all modules",
    "gateway/static/test_accessibility.py": "the pages are no Python: tried in a browser",
    "gateway/static/test_choice.py": "the page is no Python: tried in a browser",
    "gateway/static/test_drives.py": "the page is no Python: tried in a browser",
    "gateway/static/test_finds.py": "the page is no Python: tried in a browser",
    "gateway/static/test_page.py": "the page is no Python: tried in a browser",
    "gateway/static/test_pictures.py": "the page is no Python: tried in a browser",
    "gateway/test_layers.py": "imports between the folders",
    "planner/test_layers.py": "imports between the folders",
    "mapper/test_moved_things.py": "a world that changes, through the whole map",
    "mapper/test_parity.py": "a frame through projection, blur and fusion, as released",
    "mapper/test_recorded_room.py": "frames of a real camera through the whole map",
    "mapper/diagnostics/test_floor_in_apartments.py": "the floor check in simulated apartments",
    "ros2/test_nav2_processes.py": "the adapter's process beside a fake nav2",
    "ros2/test_processes.py": "the adapter's process beside a fake robot",
    "simulator/test_main.py": "starting the simulator and the replay",
    "simulator/generation/furniture/test_all_categories.py": "every piece of furniture",
}


def test_tests_lie_where_their_module_lies() -> None:
    known = {module.name for module in modules(ROOT)}
    packages = {name.removeprefix("onemap_") for name in folders(ROOT)}
    strays = []
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        parts = path.relative_to(ROOT / "tests").parts
        module = ".".join((*parts[:-1], path.stem.removeprefix("test_")))
        if parts[0] in packages and f"onemap_{module}" not in known:
            strays.append("/".join(parts))
    assert set(strays) == set(ACROSS_MODULES)
