"""``onemap models use``: check the machine, fetch models, try them, say how to configure them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import psutil
import torch
from rich.console import Console

from onemap_perception import model_store
from onemap_perception.config import (
    KNOWN_MODELS,
    KnownModel,
    NetworkParams,
    PerceptionConfig,
    TorchEncoderParams,
)
from onemap_perception.detectors.protocol import Image
from onemap_perception.encoders.checkpoint import open_device
from onemap_perception.factory import make_detector, make_encoder
from onemap_shared.config import section
from onemap_tools.errors import CliError
from onemap_tools.models.choice import check_packages, networks_of, perception_section
from onemap_tools.models.known import MEGABYTE, download, model_errors

GIGABYTE = 1e9
NUMBER_BYTES = 4  # weights are loaded in single precision, whatever their file holds
# torch, its libraries and one image of 640 x 480: 0.6 and 0.8 GB were measured beside the weights
# of tipsv2 and openclip_convnext on a CPU.
ALLOWANCE_BYTES = 1_000_000_000
CGROUP = Path("/sys/fs/cgroup")
TRIAL_PX = (640, 480)  # the image that the models must see
UNCALIBRATED = (
    "Scores of this encoder are not fitted with labels: each text competes with everyday words "
    "and counts only above what control words score on the map (docs/encoders.md)."
)


class DeviceMemory(NamedTuple):
    """Bytes that a device has, and those that nobody uses now."""

    total_bytes: int
    free_bytes: int


def needed_memory(networks: Sequence[tuple[str, int]]) -> dict[str, int]:
    """Bytes needed by device; always of the cpu, through whose memory all weights go.

    networks: device (cpu, cuda or cuda:N) and parameters of each. An estimate: the weights, those
    of the file beside them while one network is loaded, and ALLOWANCE_BYTES.
    """
    needed = {"cpu": ALLOWANCE_BYTES}
    loading = 0
    for device, parameters in networks:
        weights = parameters * NUMBER_BYTES
        needed[device] = needed.get(device, ALLOWANCE_BYTES) + weights
        loading = max(loading, weights * (1 if device == "cpu" else 2))
    needed["cpu"] += loading
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


@dataclass(frozen=True, slots=True)
class WantedModel:
    """A network of the configuration, its model and the number of its parameters."""

    params: NetworkParams
    model: KnownModel
    listing: model_store.HubListing
    parameters: int


def set_up(
    names: Sequence[str], device: str, *, confirm: Callable[[], None], console: Console
) -> dict[str, Any]:
    """Fetch the models and try them; the section for them as a JSON object. Raises CliError.

    device: empty for the best of this machine. confirm: raises CliError if the user disagrees.
    """
    device = device or ("cuda" if torch.cuda.is_available() else "cpu")
    wanted = perception_section(names, device)
    config = section({"perception": wanted}, "perception", PerceptionConfig)
    with model_errors():
        check_packages(config)
        for params in networks_of(config):
            open_device(params.device)
        models = [_look_up(params) for params in networks_of(config)]
        needed = needed_memory([(each.params.device, each.parameters) for each in models])
        present = {each: device_memory(each) for each in needed}
        check_memory(needed, present)
        _describe(models, console)
        for each, there in present.items():
            console.print(
                f"Memory of {each}: about {needed[each] / GIGABYTE:.1f} GB needed, "
                f"{there.free_bytes / GIGABYTE:.1f} of {there.total_bytes / GIGABYTE:.1f} GB free"
            )
        confirm()
        for model in models:
            download(model.model, model.listing)
        console.print("Loading them for one image ...")
        try_out(config)
    return {
        "perception": wanted,
        "note": UNCALIBRATED if isinstance(config.encoder, TorchEncoderParams) else "",
    }


def _look_up(params: NetworkParams) -> WantedModel:
    """The network's files and size; raises BackendError if it can be had nowhere."""
    model = next(model for model in KNOWN_MODELS if model.repo == params.model)
    listing = model_store.look_up(model.repo, model.files)
    folder = model_store.cached(model.repo, model.files, (listing.commit,))
    count = model_store.count_parameters
    parameters = model_store.count_parameters_here(folder) if folder else count(listing)
    return WantedModel(params, model, listing, parameters)


def check_memory(needed: Mapping[str, int], present: Mapping[str, DeviceMemory]) -> None:
    """CliError if a device is too small, by how much."""
    for device, bytes_needed in needed.items():
        total, free = present[device]
        if bytes_needed > free:
            advice = (
                "choose a smaller model or another --device"
                if bytes_needed > total
                else "end other programs, or choose another --device"
            )
            raise CliError(
                f"Too small: the models need about {bytes_needed / GIGABYTE:.1f} GB of memory on "
                f"{device}; it has {total / GIGABYTE:.1f} GB, of which {free / GIGABYTE:.1f} GB "
                f"are free: {advice}"
            )


def _describe(wanted: Sequence[WantedModel], console: Console) -> None:
    """Print licence, size and what is missing of every model."""
    for each in wanted:
        stated = each.listing.licence
        licence = each.model.licence + (f" (its page states {stated})" if stated else "")
        size, missing = each.listing.size_bytes / MEGABYTE, each.listing.missing_bytes / MEGABYTE
        page = f"https://huggingface.co/{each.model.repo}/tree/{each.listing.commit}"
        console.print(f"{each.model.repo} for {each.params.backend}")
        console.print(f"  licence: {licence}; {page}", soft_wrap=True)
        console.print(f"  size: {size:.1f} MB, to fetch: {missing:.1f} MB")


def try_out(config: PerceptionConfig) -> None:
    """Load the configured networks and let them see one black image; raises BackendError."""
    encoder = make_encoder(config.encoder)
    width, height = TRIAL_PX
    black = np.zeros((height, width, 3), np.uint8)
    features = encoder.encode(black)
    detector = make_detector(config.detector, encoder)
    detector.detect(Image(black, features), encoder.embed_text(("chair", "lamp")))
