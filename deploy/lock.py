"""Write the hashes of every package in each image, so that pip takes no other file.

    python deploy/lock.py [role ...] [--extra-index-url URL]
    python deploy/lock.py python3.10      # pins for JetPack 6; needs uv on the PATH

pip resolves the packages of a role within constraints.txt, as it would in the image, and its
report holds the hash of each file. The files are those for the machine and the Python that run
this: 3.11 on x86_64 for the locks in the repository. Needs a package index, so it is no test;
run it when pyproject.toml or constraints.txt changed.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "deploy" / "locks"
CPU_INDEX = "https://download.pytorch.org/whl/cpu"
EXTRAS = {
    "build": (),
    "router": (),
    "simulator": ("simulator",),
    "perception": ("perception", "minilm"),
    "mapper": ("mapper",),
    "planner": ("planner",),
    "gateway": ("gateway",),
}
WITHOUT_WHEEL = "sdnotify"  # one file of Python, built in the image
# Python 3.10 has no releases of some pins of constraints.txt, so it has pins of its own, without
# hashes: its torch comes from NVIDIA. What belongs to a torch with a server's CUDA is left out.
OLD_PYTHON = "python3.10"
OLD_PYTHON_EXTRAS = ("perception", "minilm", "mapper", "planner", "gateway", "ros2", "mcp", "certs")
OLD_PYTHON_HEAD = """\
# Written by deploy/lock.py python3.10; do not edit. Pins for Python 3.10 on aarch64, as JetPack 6
# has it: NumPy 1.26, which NVIDIA's builds of torch want. Newer Pythons take constraints.txt.
"""
OTHERS = re.compile(r"(nvidia|cuda)-|triton==")
OWN = re.compile(r"onemap\[([\w,-]+)\]")
HEAD = """\
# Written by deploy/lock.py from pyproject.toml and constraints.txt; do not edit.
# Every package of the image '{role}', for Python 3.11 on Linux x86_64.
"""


def requirements(project: dict[str, Any], extras: Iterable[str]) -> Iterator[str]:
    """What the base and these extras ask for, with the extras that they include."""
    yield from project["project"]["dependencies"]
    waiting, seen = list(extras), set[str]()
    while waiting:
        extra = waiting.pop()
        if extra in seen:
            continue
        seen.add(extra)
        for requirement in project["project"]["optional-dependencies"][extra]:
            if own := OWN.fullmatch(requirement):
                waiting += own[1].split(",")
            else:
                yield requirement


def project_document() -> dict[str, Any]:
    """``pyproject.toml``."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    document: dict[str, Any] = import_module("tomllib").loads(text)
    return document


def output_of(command: Sequence[str], given: str = "") -> str:
    """What a resolver prints. Raises SystemExit."""
    ended = subprocess.run(command, input=given, stdout=subprocess.PIPE, text=True, check=False)
    if ended.returncode:
        raise SystemExit("lock: there is no set of packages; the resolver's reason stands above")
    return ended.stdout


def report(wanted: Sequence[str], arguments: Sequence[str]) -> dict[str, Any]:
    """pip's report of what it would install into an empty environment."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    command += ["--dry-run", "--ignore-installed", "--only-binary=:all:"]
    command += ["--no-binary", WITHOUT_WHEEL, "--report", "-"]
    command += ["-c", str(ROOT / "constraints.txt"), *arguments, *wanted]
    document: dict[str, Any] = json.loads(output_of(command))
    return document


def resolved_for_old_python() -> list[str]:
    """A line for each package, resolved for aarch64 without installing anything."""
    command = ["uv", "pip", "compile", str(ROOT / "pyproject.toml"), "--quiet", "--no-annotate"]
    command += ["--no-header", "--python-version", "3.10", "--constraint", "-"]
    command += ["--python-platform", "aarch64-unknown-linux-gnu"]
    command += ["--only-binary", ":all:", "--no-binary", WITHOUT_WHEEL]
    command += [part for extra in OLD_PYTHON_EXTRAS for part in ("--extra", extra)]
    pins = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    torch = next(line for line in pins if line.startswith("torch=="))
    lines = output_of(command, f"{torch}\nnumpy<2\n").splitlines()
    return [line for line in lines if not OTHERS.match(line)]


def locked(document: dict[str, Any]) -> list[str]:
    """A line for each package: its version and the hash of its file. Raises SystemExit."""
    lines = []
    for package in document["install"]:
        name, version = package["metadata"]["name"], package["metadata"]["version"]
        digest = package["download_info"]["archive_info"].get("hashes", {}).get("sha256")
        if digest is None:
            raise SystemExit(f"lock: pip's report has no SHA-256 of {name} {version}")
        normal = re.sub(r"[-_.]+", "-", name).lower()
        lines.append(f"{normal}=={version} --hash=sha256:{digest}")
    return sorted(lines)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("roles", nargs="*", metavar="role", help=f"of {', '.join(EXTRAS)}")
    parser.add_argument(
        "--extra-index-url",
        default=CPU_INDEX,
        help="where torch without CUDA is (default: %(default)s)",
    )
    parser.add_argument(
        "--requirements", metavar="EXTRAS", help="print what these extras ask for, and end"
    )
    chosen = parser.parse_args()
    if chosen.requirements is not None:
        extras = [extra for extra in chosen.requirements.split(",") if extra]
        print("\n".join(requirements(project_document(), extras)))
        return
    for role in chosen.roles or EXTRAS:
        if role == OLD_PYTHON:
            text = OLD_PYTHON_HEAD + "\n".join(resolved_for_old_python()) + "\n"
            (FOLDER / f"{role}.txt").write_text(text, encoding="utf-8")
            continue
        if role not in EXTRAS:
            raise SystemExit(f"lock: there is no role {role!r}; there are {', '.join(EXTRAS)}")
        project = project_document()
        arguments = ("--extra-index-url", chosen.extra_index_url) if chosen.extra_index_url else ()
        wanted = list(requirements(project, EXTRAS[role]))
        if role == "build":  # what builds OneMap, and a package without a wheel
            wanted = [*project["build-system"]["requires"], "setuptools>=77"]
        lines = locked(report(wanted, arguments))
        FOLDER.mkdir(exist_ok=True)
        text = HEAD.format(role=role) + "\n".join(lines) + "\n"
        (FOLDER / f"{role}.txt").write_text(text, encoding="utf-8")
        print(f"{role}: {len(lines)} packages")


if __name__ == "__main__":
    main()
