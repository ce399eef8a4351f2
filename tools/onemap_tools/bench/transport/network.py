"""Two network namespaces of this machine with a shaped link between them. Linux, as root."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType

from onemap_tools.bench.transport.link_shape import LinkShape

TUN = Path("/dev/net/tun")
ADDRESSES = ("10.77.0.1", "10.77.0.2")  # of the robot's side and the other one
CONGESTION_CONTROL = "/proc/sys/net/ipv4/tcp_congestion_control"
ENDING_S = 5.0


class NoEmulation(Exception):
    """This machine cannot emulate a link; the text says why and what to do."""


def emulation_problem() -> str:
    """Why no link can be emulated here, in one sentence; empty if one can be."""
    if sys.platform != "linux":
        return "links are emulated with Linux' network namespaces; this is another system"
    if os.geteuid() != 0:
        return "emulated links need root, for network namespaces: run it with sudo"
    if shutil.which("ip") is None:
        return "emulated links need the command 'ip': apt-get install iproute2"
    if not TUN.exists():
        return f"emulated links need {TUN}: load the kernel module tun"
    probe = f"onemap-probe-{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", probe], capture_output=True, check=False)
    if made.returncode:
        reason = made.stderr.decode(errors="replace").strip()
        return f"network namespaces cannot be made here: {reason}"
    subprocess.run(["ip", "netns", "del", probe], capture_output=True, check=False)
    return ""


class EmulatedLink:
    """A context manager: two namespaces, and the process that passes packets between them.

    ``congestion_control`` of TCP in both namespaces, for example cubic; empty: the machine's.
    """

    def __init__(self, shape: LinkShape, congestion_control: str = "") -> None:
        self._shape, self._congestion_control = shape, congestion_control
        self.names = tuple(f"onemap-{os.getpid()}-{side}" for side in "ab")
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> EmulatedLink:
        problem = emulation_problem()
        if problem:
            raise NoEmulation(problem)
        try:
            self._make()
        except BaseException:
            self._remove()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._remove()

    def command(self, side: int, *command: str) -> tuple[str, ...]:
        """A command line that runs ``command`` in the namespace of side 0 or 1."""
        return ("ip", "netns", "exec", self.names[side], *command)

    def carried(self) -> Mapping[str, int]:
        """Bytes from side 0 to 1 (``up``) and back (``down``) so far, and packets dropped."""
        assert self._process is not None
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        up, down, dropped = self._process.stdout.readline().split()
        return {"up": int(up), "down": int(down), "dropped": int(dropped)}

    def _make(self) -> None:
        for name in self.names:
            _ip("netns", "add", name)
            _ip("-n", name, "link", "set", "lo", "up")
        shape = self._shape
        numbers = (shape.rate_bps, shape.delay_s, shape.loss)
        self._process = subprocess.Popen(
            [sys.executable, "-m", f"{__package__}.link_process", *self.names, *map(str, numbers)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        if self._process.stdout.readline() != "ready\n":
            raise NoEmulation(f"the link could not be made: is {TUN} allowed here?")
        for name, own, other in zip(self.names, ADDRESSES, reversed(ADDRESSES), strict=True):
            _ip("-n", name, "addr", "add", own, "peer", other, "dev", "link0")
            _ip("-n", name, "link", "set", "link0", "up")
            if self._congestion_control:
                write = f"echo {self._congestion_control} > {CONGESTION_CONTROL}"
                _run("ip", "netns", "exec", name, "sh", "-c", write)

    def _remove(self) -> None:
        if self._process is not None:
            self._process.terminate()
            self._process.communicate(timeout=ENDING_S)
        for name in self.names:
            subprocess.run(["ip", "netns", "del", name], capture_output=True, check=False)


def _ip(*arguments: str) -> None:
    _run("ip", *arguments)


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, check=False)
    if done.returncode:
        reason = done.stderr.decode(errors="replace").strip()
        raise NoEmulation(f"'{' '.join(command)}' failed: {reason}")
