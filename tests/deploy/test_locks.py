"""The hashes of what images install: complete, and of the versions that are pinned."""

from __future__ import annotations

import importlib.util
import re
from typing import Any

import pytest

from tests.deploy.deployment import DEPLOY, ROLES
from tests.deploy.test_extras import project
from tests.structure import ROOT

LINE = re.compile(r"([a-z0-9-]+)==(\S+) --hash=sha256:[0-9a-f]{64}")


def load_script() -> Any:
    spec = importlib.util.spec_from_file_location("lock", DEPLOY / "lock.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


lock = load_script()
LOCKED = sorted(lock.EXTRAS)


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def pins() -> dict[str, str]:
    """The versions of constraints.txt by normal name."""
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    pairs = (line.split("==") for line in text.splitlines() if "==" in line)
    return {normal(name): version for name, version in pairs}


def packages(role: str) -> dict[str, str]:
    """The versions of a lock by normal name; every line has a hash."""
    text = (DEPLOY / "locks" / f"{role}.txt").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    found = [LINE.fullmatch(line) for line in lines]
    assert all(found), "a line without a version and a hash"
    return {each[1]: each[2] for each in found if each is not None}


def test_there_is_a_lock_for_every_image() -> None:
    assert {"build", "router", *ROLES} == set(lock.EXTRAS)
    files = {path.name.removesuffix(".txt") for path in (DEPLOY / "locks").iterdir()}
    assert files == {*lock.EXTRAS, lock.OLD_PYTHON}


@pytest.mark.parametrize("role", LOCKED)
def test_a_lock_holds_the_pinned_versions(role: str) -> None:
    pinned = pins()
    for name, version in packages(role).items():
        if name in pinned:
            assert version.split("+")[0] == pinned[name], f"{name}: run deploy/lock.py"


@pytest.mark.parametrize("role", [role for role in LOCKED if role != "build"])
def test_a_lock_holds_what_the_role_asks_for(role: str) -> None:
    """A requirement that was added to pyproject.toml needs a new lock."""
    wanted = {
        normal(re.split(r"[\[<>=!~; ]", requirement)[0])
        for requirement in lock.requirements(project_document(), lock.EXTRAS[role])
    }
    assert wanted <= set(packages(role)), "run deploy/lock.py"


def test_python_3_10_has_a_pin_for_everything_the_services_ask_for() -> None:
    text = (DEPLOY / "locks" / f"{lock.OLD_PYTHON}.txt").read_text(encoding="utf-8")
    pinned = dict(line.split("==") for line in text.splitlines() if "==" in line)
    wanted = {
        normal(re.split(r"[\[<>=!~; ]", requirement)[0])
        for requirement in lock.requirements(project_document(), lock.OLD_PYTHON_EXTRAS)
    }
    assert wanted <= {normal(name) for name in pinned}, "run deploy/lock.py python3.10"
    assert pinned["numpy"].startswith("1.26.")
    assert pinned["torch"] == pins()["torch"]
    assert not any(name.startswith(("nvidia-", "cuda-")) for name in pinned)


def project_document() -> dict[str, Any]:
    return {"project": project()}


def test_a_file_without_a_hash_is_refused() -> None:
    document = {
        "install": [
            {
                "metadata": {"name": "Some.Package", "version": "1.0"},
                "download_info": {"archive_info": {"hashes": {"sha256": "0" * 64}}},
            }
        ]
    }
    assert lock.locked(document) == [f"some-package==1.0 --hash=sha256:{'0' * 64}"]
    document["install"][0]["download_info"] = {"archive_info": {}}
    with pytest.raises(SystemExit, match=r"no SHA-256 of Some\.Package 1\.0"):
        lock.locked(document)
