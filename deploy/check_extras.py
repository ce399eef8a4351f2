"""Install each service's extra alone in a fresh virtual environment and start the service.

    python deploy/check_extras.py [service ...]

Needs a package index, so it is not one of the tests; `make extras` runs it with the development
environment's Python.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
import venv
from pathlib import Path

from onemap_shared.services import ALL
from onemap_tools.processes.network import any_free_port

ROOT = Path(__file__).parents[1]
NAMES = tuple(service.name for service in ALL if service.name == service.extra)
START_S = 60.0  # a cold import of torch on two busy cores


def install(service: str, folder: Path) -> Path:
    """A new environment with ``onemap[service]`` and nothing else; returns its bin folder."""
    venv.create(folder, with_pip=True)
    pip = [str(folder / "bin" / "pip"), "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, "-c", str(ROOT / "constraints.txt"), f"{ROOT}[{service}]"], check=True)
    return folder / "bin"


def starts(service: str, bin_folder: Path) -> bool:
    """Whether the service is up before ``START_S`` and stops cleanly at SIGTERM; else its log."""
    endpoint = f"tcp/127.0.0.1:{any_free_port()}"
    environment = {
        **os.environ,
        "ONEMAP__BUS__CONNECT": f"[{endpoint}]",
        "ONEMAP__GATEWAY__PORT": str(any_free_port()),
    }
    onemap = bin_folder / "onemap"
    router = subprocess.Popen([onemap, "router", "--listen", endpoint], env=environment)
    process = subprocess.Popen(
        [onemap, service], env=environment, stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    too_late = threading.Timer(START_S, process.kill)
    too_late.start()
    lines: list[str] = []
    try:
        for line in process.stderr:
            lines.append(line)
            if f"{service} is up" in line:
                process.terminate()
                return process.wait(timeout=10) == 0
        sys.stderr.writelines(lines)
        return False
    finally:
        too_late.cancel()
        process.kill()
        router.kill()


def main(services: list[str]) -> int:
    """Check the named services, all by default; 0 only if every one starts."""
    failed = []
    for service in services or NAMES:
        with tempfile.TemporaryDirectory() as folder:
            bin_folder = install(service, Path(folder) / "venv")
            good = starts(service, bin_folder)
        print(f"{service}: {'starts' if good else 'does not start'}", flush=True)
        failed += [] if good else [service]
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
