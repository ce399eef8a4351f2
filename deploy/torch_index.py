"""Which build of torch pip should take on this machine; prints the arguments for pip.

    python deploy/torch_index.py [auto|cpu|cuda]

On Linux, PyPI's torch brings CUDA along: gigabytes that a machine without an NVIDIA GPU does
not need. PyTorch's own index has the same version without it. ``auto`` adds that index
where there is no GPU and the index answers, ``cpu`` always, ``cuda`` never. One sentence
on stderr says what was decided and why. Run it with the Python that torch is installed for.

Standard library only: it runs before anything is installed.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

CPU_INDEX = "https://download.pytorch.org/whl/cpu"
CPU = ("--extra-index-url", CPU_INDEX)
CHOICES = ("auto", "cpu", "cuda")
ANSWER_S = 3.0  # one attempt: offline machines should not wait longer
DRIVER_FILE = Path("/proc/driver/nvidia/version")
NVIDIA_SMI = ("nvidia-smi", "-L")
NVIDIA_SMI_S = 10.0  # starting the driver takes seconds; without one it fails at once
OWN_SETTINGS = ("PIP_INDEX_URL", "PIP_EXTRA_INDEX_URL", "PIP_NO_INDEX")
CPU_ARCHITECTURES = ("x86_64", "aarch64", "arm64")  # that the CPU index has wheels for


class Machine(NamedTuple):
    """Inputs of the decision. ``torch``: the installed version, empty without one;
    ``own_settings``: pip settings of the user in the environment."""

    system: str
    architecture: str
    nvidia: bool
    torch: str
    own_settings: tuple[str, ...]


class Decision(NamedTuple):
    """Arguments of ``pip install`` and the sentence that explains them."""

    arguments: tuple[str, ...]
    reason: str


def decide(choice: str, machine: Machine, reachable: Callable[[], bool]) -> Decision:
    """Arguments for pip; ``reachable`` checks whether the CPU index answers, if that matters."""
    plain: tuple[str, ...] = ()
    own = "torch: the CPU build from PyTorch's own index"
    settings = " and ".join(machine.own_settings)
    elsewhere = machine.architecture not in CPU_ARCHITECTURES
    for holds, arguments, reason in (
        (machine.torch, plain, f"torch {machine.torch} is installed already and stays."),
        (
            machine.system != "Linux",
            plain,
            f"torch: PyPI's build, the only one for {machine.system}.",
        ),
        (choice == "cpu", CPU, f"{own}, as asked for."),
        (choice == "cuda", plain, "torch: PyPI's build with CUDA, as asked for."),
        (settings, plain, f"torch: what pip finds with your {settings}."),
        (machine.nvidia, plain, "torch: PyPI's build with CUDA, because there is an NVIDIA GPU."),
        (elsewhere, plain, f"torch: what PyPI has for {machine.architecture}."),
    ):
        if holds:
            return Decision(arguments, reason)
    if reachable():
        reason = "because there is no NVIDIA GPU here (TORCH=cuda takes the other)"
        return Decision(CPU, f"{own}, {reason}.")
    reason = f"because {CPU_INDEX} does not answer (TORCH=cpu insists on it)"
    return Decision(plain, f"torch: what pip finds, perhaps with some GB of CUDA, {reason}.")


def inspect_machine(environment: Mapping[str, str]) -> Machine:
    """This machine, and the torch of this Python."""
    try:
        torch = version("torch")
    except PackageNotFoundError:
        torch = ""
    return Machine(
        platform.system(),
        platform.machine(),
        has_nvidia(DRIVER_FILE, NVIDIA_SMI),
        torch,
        tuple(name for name in OWN_SETTINGS if environment.get(name)),
    )


def has_nvidia(driver_file: Path, command: tuple[str, ...]) -> bool:
    """Whether an NVIDIA driver is loaded, or the command finds a GPU (as on WSL)."""
    if driver_file.exists():
        return True
    options: dict[str, Any] = {"capture_output": True, "stdin": subprocess.DEVNULL}
    try:
        done = subprocess.run(command, check=False, timeout=NVIDIA_SMI_S, **options)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0 and bool(done.stdout.strip())


def answers(url: str, limit_s: float = ANSWER_S) -> bool:
    """Whether there is a page; uses the proxies of the environment."""
    request = urllib.request.Request(url, method="HEAD")
    try:
        with urllib.request.urlopen(request, timeout=limit_s):
            return True
    except OSError:  # no name, no route, no certificate, no HTTP, an error page
        return False


def main(arguments: list[str]) -> int:
    """Print the arguments for pip; 2 if the choice is unknown."""
    choice = arguments[0] if arguments else "auto"
    if choice not in CHOICES or len(arguments) > 1:
        given = " ".join(arguments)
        print(f"TORCH is {given!r}; it must be one of {', '.join(CHOICES)}.", file=sys.stderr)
        return 2
    decision = decide(choice, inspect_machine(os.environ), lambda: answers(f"{CPU_INDEX}/torch/"))
    print(decision.reason, file=sys.stderr)
    print(*decision.arguments)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
