"""Write the hashes of every package in each image, so that pip takes no other file.

    python deploy/lock.py [role ...] [--extra-index-url URL]
    python deploy/lock.py python3.10      # for JetPack 6; needs uv on the PATH
    python deploy/lock.py --aarch64       # whether aarch64 has a file for each pin of each lock

pip resolves the packages of a role within constraints.txt, as it would in the image, and its
report holds the hash of each file. The files are those for the machine and the Python that run
this: 3.11 on x86_64 for the locks in the repository. Needs a package index and a recent pip (26),
so it is no test; run it when pyproject.toml or constraints.txt changed.
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
BUILD_WITH = ("setuptools>=77",)  # it
# Python 3.10 has no releases of some pins of constraints.txt, so it has a lock of its own, for all
# services and for both architectures. What belongs to a torch with a server's CUDA is left out.
OLD_PYTHON = "python3.10"
OLD_PYTHON_EXTRAS = (
    *("perception", "minilm", "mapper", "planner", "gateway", "ros2", "mcp", "certs"),
    *("openclip", "transformers"),
)
OLD_PYTHON_HEAD = """\
# Written by deploy/lock.py python3.10; do not edit. For Python 3.10, as JetPack 6 has it, on
# aarch64 and x86_64: NumPy 1.26, which NVIDIA's builds of torch want. torch, theirs or this one,
# has no hash. Newer Pythons take constraints.txt.
"""
GLIBC_OF_JETPACK_6 = 35
NO_AARCH64 = ("embreex",)  # of the simulator
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


def report(wanted: Iterable[str], arguments: Sequence[str]) -> dict[str, Any]:
    """pip's report of what it would install into an empty environment."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    command += ["--dry-run", "--ignore-installed", "--only-binary=:all:"]
    command += ["--no-binary", WITHOUT_WHEEL, "--report", "-"]
    command += [*arguments, *wanted]
    document: dict[str, Any] = json.loads(output_of(command))
    return document


def reported_for(machine: str, python: str, pins: Iterable[str]) -> dict[str, Any]:
    """pip's report of the files of these pins for another machine or Python."""
    platforms = [f"manylinux_2_{glibc}_{machine}" for glibc in range(17, GLIBC_OF_JETPACK_6 + 1)]
    arguments = [part for name in (*platforms, f"linux_{machine}") for part in ("--platform", name)]
    return report(pins, ["--no-deps", "--python-version", python, *arguments])


def resolved_for_old_python(project: dict[str, Any]) -> list[str]:
    """A line for each package with the hashes of its files, without installing anything."""
    command = ["uv", "pip", "compile", "-", "--quiet", "--no-annotate", "--no-header"]
    command += ["--python-version", "3.10", "--python-platform", "aarch64-unknown-linux-gnu"]
    command += ["--only-binary", ":all:", "--no-binary", WITHOUT_WHEEL]
    torch = next(pin for pin in pins_of(ROOT / "constraints.txt") if pin.startswith("torch=="))
    wanted = [*requirements(project, OLD_PYTHON_EXTRAS), *BUILD_WITH, torch, "numpy<2"]
    wanted += project["build-system"]["requires"]
    resolved = output_of(command, "\n".join(wanted)).splitlines()
    pins = [pin for pin in resolved if not OTHERS.match(pin) and pin != torch]
    locks = [locked(reported_for(machine, "3.10", pins)) for machine in ("aarch64", "x86_64")]
    return sorted([torch, *map(joined, *locks)])


def joined(line: str, other: str) -> str:
    """The line of a package with the hash of its file for the other machine."""
    pin, digest = other.split()
    assert line.startswith(f"{pin} "), f"{line} for one machine, {other} for the other"
    return line if digest in line else f"{line} {digest}"


def pins_of(file: Path) -> list[str]:
    """The pins of a lock or of constraints, without hashes and builds of torch."""
    lines = file.read_text(encoding="utf-8").splitlines()
    return [re.split(r"[+ ]", line)[0] for line in lines if not line.startswith("#")]


def check_aarch64() -> None:
    """Whether there is a file for each pin of each lock; SystemExit with the reason if not."""
    for file in sorted(FOLDER.iterdir()):
        pins = [pin for pin in pins_of(file) if not pin.startswith(NO_AARCH64)]
        python = "3.10" if file.stem == OLD_PYTHON else "3.11"
        found = reported_for("aarch64", python, pins)["install"]
        print(f"{file.stem}: aarch64 has {len(found)} of {len(pins)} packages")


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
    parser.add_argument("--aarch64", action="store_true", help="check the locks, and end")
    chosen = parser.parse_args()
    if chosen.aarch64:
        check_aarch64()
        return
    if chosen.requirements is not None:
        extras = [extra for extra in chosen.requirements.split(",") if extra]
        print("\n".join(requirements(project_document(), extras)))
        return
    for role in chosen.roles or EXTRAS:
        if role == OLD_PYTHON:
            text = OLD_PYTHON_HEAD + "\n".join(resolved_for_old_python(project_document())) + "\n"
            (FOLDER / f"{role}.txt").write_text(text, encoding="utf-8")
            continue
        if role not in EXTRAS:
            raise SystemExit(f"lock: there is no role {role!r}; there are {', '.join(EXTRAS)}")
        project = project_document()
        arguments = ["-c", str(ROOT / "constraints.txt")]
        if chosen.extra_index_url:
            arguments += ["--extra-index-url", chosen.extra_index_url]
        wanted = list(requirements(project, EXTRAS[role]))
        if role == "build":  # what builds OneMap, and a package without a wheel
            wanted = [*project["build-system"]["requires"], *BUILD_WITH]
        lines = locked(report(wanted, arguments))
        FOLDER.mkdir(exist_ok=True)
        text = HEAD.format(role=role) + "\n".join(lines) + "\n"
        (FOLDER / f"{role}.txt").write_text(text, encoding="utf-8")
        print(f"{role}: {len(lines)} packages")


if __name__ == "__main__":
    main()
