"""Needed memory against present memory."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from onemap_tools.model_setup import memory
from onemap_tools.model_setup.memory import (
    ALLOWANCE_BYTES,
    DeviceMemory,
    Network,
    best_device,
    device_memory,
    needed_memory,
    shortage,
    used_memory,
)

GB = 1_000_000_000


def test_on_a_cpu_a_network_lies_beside_its_file_while_it_is_loaded() -> None:
    one = needed_memory([Network("cpu", 100_000_000)])
    assert one == {"cpu": ALLOWANCE_BYTES + 2 * 400_000_000}
    two = needed_memory([Network("cpu", 100_000_000), Network("cpu", 50_000_000)])
    assert two == {"cpu": ALLOWANCE_BYTES + 600_000_000 + 400_000_000}


def test_on_a_gpu_the_weights_pass_through_the_machines_memory() -> None:
    needed = needed_memory([Network("cuda", 100_000_000), Network("cpu", 50_000_000)])
    assert needed == {
        "cuda": ALLOWANCE_BYTES + 400_000_000,
        "cpu": ALLOWANCE_BYTES + 200_000_000 + 800_000_000,
    }
    assert needed_memory([]) == {"cpu": ALLOWANCE_BYTES}


@pytest.mark.parametrize("device", ["cpu", "cuda:1"])
def test_a_device_that_is_too_small_is_named_with_figures(device: str) -> None:
    present = {device: DeviceMemory(4 * GB, 3 * GB)}
    assert shortage({device: 3 * GB}, present) == ""
    assert shortage({device: 3_500_000_000}, present) == (
        f"the models need about 3.5 GB of memory on {device}; it has 4.0 GB, of which 3.0 GB "
        "are free: end other programs, or choose another --device"
    )
    assert shortage({device: 8 * GB}, present).endswith(
        "choose a smaller model or another --device"
    )


def test_the_memory_of_this_machine_is_read() -> None:
    here = device_memory("cpu")
    assert 0 < here.free_bytes <= here.total_bytes


def test_the_limit_of_a_container_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "CGROUP", tmp_path)
    (tmp_path / "memory.max").write_text("50000000\n")
    (tmp_path / "memory.current").write_text("20000000\n")
    assert device_memory("cpu") == DeviceMemory(50_000_000, 30_000_000)
    (tmp_path / "memory.max").write_text("max\n")
    assert device_memory("cpu").total_bytes > 50_000_000


def test_the_memory_of_this_process_is_at_least_that_of_an_array() -> None:
    array = torch.ones(20_000_000)
    assert used_memory("cpu") >= array.nbytes


def test_the_best_device_is_one_that_this_torch_can_use() -> None:
    torch.empty(1, device=best_device())


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device")
def test_the_memory_of_a_gpu_is_read() -> None:
    there = device_memory("cuda")
    assert 0 < there.free_bytes <= there.total_bytes
    array = torch.ones(1_000_000, device="cuda")
    assert used_memory("cuda") >= array.nbytes
