"""Which device the map lives on, where the configuration leaves it open.

A Jetson's GPU may come later than its services at boot.
"""
# Talks: asks a process of its own whether the GPU is there by now.

from __future__ import annotations

import logging
import subprocess
import sys
import time
from pathlib import Path

import torch

from onemap_shared.runner import StartError

LOG = logging.getLogger("onemap.mapper")
AUTO = "auto"
WAIT_S, PAUSE_S = 30.0, 2.0  # a GPU that takes longer than this after boot was never seen
# Of a Jetson, and of the driver of other NVIDIA GPUs.
SIGNS = (Path("/etc/nv_tegra_release"), Path("/proc/driver/nvidia/version"))
# A process that once found no GPU finds none later.
ASK = "import sys, torch; sys.exit(not torch.cuda.is_available())"


def resolved_device(device: str) -> str:
    """``cpu`` or ``cuda``; raises StartError where CUDA is asked for and cannot be used now.

    auto: the GPU if this torch can use one. Where the machine has one that does not answer yet, it
    is waited for; then the map lives on the CPU, with a warning.
    """
    if device == AUTO:
        if torch.version.cuda is None:
            return "cpu"
        if torch.cuda.is_available():
            return "cuda"
        if any(sign.exists() for sign in SIGNS):
            if _comes():
                raise StartError("the GPU came late: the mapper starts again", temporary=True)
            LOG.warning("the GPU does not answer after %.0f s: the map is on the CPU", WAIT_S)
        return "cpu"
    if device.startswith("cuda") and not torch.cuda.is_available():
        raise StartError(
            f"device is {device}, but torch finds no GPU: set device: auto", temporary=True
        )
    return device


def _comes() -> bool:
    end_s = time.monotonic() + WAIT_S
    while time.monotonic() < end_s:
        if subprocess.run([sys.executable, "-c", ASK], check=False).returncode == 0:
            return True
        time.sleep(PAUSE_S)
    return False
