"""How much memory networks need, and whether a device has it."""

from __future__ import annotations

import resource
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import psutil
import torch

GIGABYTE = 1e9
NUMBER_BYTES = 4  # weights are loaded in single precision, whatever their file holds
# torch, its libraries and one image of 640 x 480: 'onemap bench perception --random-weights'
# measured 0.6 and 0.8 GB beside the weights of tipsv2 and openclip_convnext on a CPU.
ALLOWANCE_BYTES = 1_000_000_000
CGROUP = Path("/sys/fs/cgroup")


@dataclass(frozen=True, slots=True)
class Network:
    """A network to load. device: cpu, cuda or cuda:N; parameters: numbers in its weights."""

    device: str
    parameters: int


@dataclass(frozen=True, slots=True)
class DeviceMemory:
    """Bytes that a device has, and those that nobody uses now."""

    total_bytes: int
    free_bytes: int


def needed_memory(networks: Sequence[Network]) -> dict[str, int]:
    """Bytes needed by device; always of the cpu, through whose memory all weights go.

    An estimate: the weights, those of the file beside them while one network is loaded, and
    ALLOWANCE_BYTES.
    """
    needed: dict[str, int] = {}
    for network in networks:
        weights = network.parameters * NUMBER_BYTES
        needed[network.device] = needed.get(network.device, ALLOWANCE_BYTES) + weights
    loading = max(
        (n.parameters * NUMBER_BYTES * (1 if n.device == "cpu" else 2) for n in networks),
        default=0,
    )
    needed["cpu"] = needed.get("cpu", ALLOWANCE_BYTES) + loading
    return needed


def device_memory(device: str) -> DeviceMemory:
    """What the device has; of a cpu inside a container what the container may use."""
    if device != "cpu":
        free, total = torch.cuda.mem_get_info(torch.device(device))
        return DeviceMemory(total, free)
    machine = psutil.virtual_memory()
    limit, used = (_cgroup_bytes(name) for name in ("memory.max", "memory.current"))
    if limit is None or limit >= machine.total:
        return DeviceMemory(machine.total, machine.available)
    return DeviceMemory(limit, max(0, min(machine.available, limit - (used or 0))))


def _cgroup_bytes(name: str) -> int | None:
    with suppress(OSError, ValueError):  # no container, or no limit
        return int((CGROUP / name).read_text(encoding="ascii"))
    return None


def shortage(needed: Mapping[str, int], present: Mapping[str, DeviceMemory]) -> str:
    """Which device is too small and by how much, in a sentence; empty if none is."""
    for device, bytes_needed in needed.items():
        there = present[device]
        if bytes_needed > there.free_bytes:
            advice = (
                "choose a smaller model or another --device"
                if bytes_needed > there.total_bytes
                else "end other programs, or choose another --device"
            )
            return (
                f"the models need about {bytes_needed / GIGABYTE:.1f} GB of memory on {device}; "
                f"it has {there.total_bytes / GIGABYTE:.1f} GB, of which "
                f"{there.free_bytes / GIGABYTE:.1f} GB are free: {advice}"
            )
    return ""


def used_memory(device: str) -> int:
    """Most bytes of the device that this process has held so far; of a GPU those for tensors."""
    if device == "cpu":
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return torch.cuda.max_memory_reserved(torch.device(device))


def best_device() -> str:
    """``cuda`` if torch can use one here, else ``cpu``."""
    return "cuda" if torch.cuda.is_available() else "cpu"
