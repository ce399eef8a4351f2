"""The device of the map, where the configuration leaves it open."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from onemap_mapper import warm_up as gpu
from onemap_shared.runner import StartError


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> pytest.MonkeyPatch:
    """A torch with CUDA, on a machine that has a GPU which does not answer."""
    sign = tmp_path / "driver"
    sign.touch()
    monkeypatch.setattr(gpu, "SIGNS", (sign,))
    monkeypatch.setattr(gpu, "WAIT_S", 5.0)
    monkeypatch.setattr(gpu, "PAUSE_S", 0.0)
    monkeypatch.setattr(torch.version, "cuda", "13.0")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    return monkeypatch


def test_auto_takes_the_gpu_if_torch_can_use_one(machine: pytest.MonkeyPatch) -> None:
    machine.setattr(torch.cuda, "is_available", lambda: True)
    assert gpu.resolved_device("auto") == "cuda"
    machine.setattr(torch.version, "cuda", None)
    assert gpu.resolved_device("auto") == "cpu"


def test_a_gpu_that_comes_late_starts_the_mapper_again(machine: pytest.MonkeyPatch) -> None:
    machine.setattr(gpu, "ASK", "pass")
    with pytest.raises(StartError, match="came late") as problem:
        gpu.resolved_device("auto")
    assert problem.value.temporary  # exit code 1: systemd starts it again


def test_a_gpu_that_never_comes_is_not_waited_for_for_ever(machine: pytest.MonkeyPatch) -> None:
    machine.setattr(gpu, "ASK", "raise SystemExit(1)")
    machine.setattr(gpu, "WAIT_S", 0.2)
    assert gpu.resolved_device("auto") == "cpu"
    machine.setattr(gpu, "SIGNS", ())  # no such machine: not waited for at all
    machine.setattr(gpu, "WAIT_S", 1e9)
    assert gpu.resolved_device("auto") == "cpu"


def test_cuda_without_a_gpu_is_refused_and_tried_again(machine: pytest.MonkeyPatch) -> None:
    with pytest.raises(StartError, match="set device: auto") as problem:
        gpu.resolved_device("cuda:0")
    assert problem.value.temporary
    assert gpu.resolved_device("cpu") == "cpu"
