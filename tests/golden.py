"""The golden run: what a rebuilding of the code must leave as it is, as hashes.

``python -m tests.golden`` computes them and compares with ``tests/golden.json``; exit code 1 if
one differs, ``--write`` replaces the file. The last bits of a search depend on the processor and
on numba's and torch's builds: compare on one machine, write first where it is another.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.storage.map_file import write
from onemap_mapper.storage.snapshot import sha256_of, take
from onemap_shared import wire
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from tests.gateway.fakes import client_on
from tests.mapper import scenes
from tests.memory_bus import MemoryRouter
from tests.shared.samples import SAMPLES

FILE = Path(__file__).with_name("golden.json")
POSES = ((-0.5, 0.2, 0.0), (0.4, -0.3, 2.0), (0.9, 0.8, 4.0), (-1.2, 0.6, 5.5))
TIMES = {"wall_s", "planning_p50_ms", "planning_p95_ms"}  # that no two runs share


def of(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def navigation(*options: str) -> str:
    """Episodes with trajectories, of ``onemap bench navigation`` in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        command = [str(Path(sys.executable).with_name("onemap")), "bench", "navigation"]
        options = ("--features", "simulated", "--episodes", "2", "--workers", "2", *options)
        subprocess.run([*command, *options, "--out", folder], check=True, capture_output=True)
        lines = (Path(folder) / "episodes.jsonl").read_text(encoding="utf-8").splitlines()
    episodes = sorted((json.loads(line) for line in lines), key=lambda episode: episode["index"])
    kept = [{k: v for k, v in episode.items() if k not in TIMES} for episode in episodes]
    return of(json.dumps(kept, sort_keys=True).encode())


def belief(compiled: bool) -> BeliefMap:
    params = scenes.params(compiled=compiled)
    belief = BeliefMap(params)
    for sequence, pose in enumerate(POSES):
        belief.fuse(compute_update(scenes.field(sequence, scenes.pose(*pose)), params))
    return belief


def map_file() -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "golden.npz"
        write(take(belief(compiled=True)), path)
        return of(path.read_bytes())


def wire_bytes() -> str:
    packets = [wire.encode(sample) for sample in SAMPLES]
    return of(b"".join(packet.header + packet.body for packet in packets))


def http_interface() -> str:
    """Paths, parameters, schemas and status codes that the gateway documents."""
    with client_on(MemoryRouter()) as client:
        return of(json.dumps(client.get("/openapi.json").json(), sort_keys=True).encode())


def apartments() -> str:
    """All that 20 seeds generate, in both styles."""
    digest = hashlib.sha256()
    for seed in range(1, 21):
        scene = generate_apartment(seed, list(STYLES.values())[seed % 2])
        shape = (scene.vertices, scene.faces, scene.face_object, scene.face_texture)
        arrays: tuple[np.ndarray, ...] = (*shape, scene.face_uv, *scene.textures)
        for each in arrays:
            digest.update(each.tobytes())
        rest = (scene.objects, scene.lights, scene.ambient, scene.rooms, scene.start)
        digest.update(repr(rest).encode())
    return digest.hexdigest()[:16]


RUNS: dict[str, Callable[[], str]] = {
    "wire": wire_bytes,
    "map_compiled": lambda: sha256_of(take(belief(compiled=True)))[:16],
    "map_torch": lambda: sha256_of(take(belief(compiled=False)))[:16],
    "map_file": map_file,
    "http_interface": http_interface,
    "apartments": apartments,
    "navigation": lambda: navigation("--seed", "11", "--apartments", "odd"),
    "navigation_depth_errors": lambda: navigation("--seed", "20", "--errors", "depth"),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="*", help=f"only these, of {', '.join(RUNS)}")
    parser.add_argument("--write", action="store_true", help="replace the golden hashes")
    options = parser.parse_args()
    golden = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    found = {}
    for name in options.runs or RUNS:
        found[name] = RUNS[name]()
        same = "same" if found[name] == golden.get(name) else f"was {golden.get(name)}"
        print(f"{name:24} {found[name]}  {same}", flush=True)
    if options.write:
        FILE.write_text(json.dumps(golden | found, indent=2) + "\n", encoding="utf-8")
    return int(any(golden.get(name) != value for name, value in found.items()))


if __name__ == "__main__":
    sys.exit(main())
