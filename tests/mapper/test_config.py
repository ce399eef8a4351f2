"""The mapper's section and the map that it makes; the device, where it is left open."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from onemap_mapper import warm_up as gpu
from onemap_mapper.config import MapperConfig
from onemap_mapper.params import MapParams
from onemap_shared.clock import SystemClock
from onemap_shared.config import ConfigError, section
from onemap_shared.runner import StartError


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"cellsize_m": 0.1}, "did you mean 'cell_size_m'"),
        ({"cell_size_m": 0.01}, "greater than or equal to 0.05"),
        ({"device": "gpu"}, "should match pattern"),
        ({"depth_noise_m": -0.001}, "greater than or equal to 0"),
        ({"max_feature_range_m": 6.0}, "is now called 'depth_range_m'"),
        ({"robots": ["fleet/r1", "fleet/r1"]}, "each robot once"),
        ({"robots": ["/r1"]}, "should match pattern"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(values: dict[str, object], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        section({"mapper": values}, "mapper", MapperConfig)


@pytest.mark.parametrize(
    ("noise_m", "range_m"), [(0.005, 4.472), (0.0, 8.0), (0.001, 8.0), (0.02, 2.236)]
)
def test_obstacles_end_where_the_depth_is_as_uncertain_as_a_cell(
    noise_m: float, range_m: float
) -> None:
    params = MapParams(depth_noise_m=noise_m)
    assert params.obstacle_range_m == pytest.approx(range_m, abs=1e-3)


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
    assert gpu.resolved_device("auto", SystemClock()) == "cuda"
    machine.setattr(torch.version, "cuda", None)
    assert gpu.resolved_device("auto", SystemClock()) == "cpu"


def test_a_gpu_that_comes_late_starts_the_mapper_again(machine: pytest.MonkeyPatch) -> None:
    machine.setattr(gpu, "ASK", "pass")
    with pytest.raises(StartError, match="answers only now") as problem:
        gpu.resolved_device("auto", SystemClock())
    assert problem.value.temporary  # exit code 1: systemd starts it again


def test_a_gpu_that_never_comes_is_not_waited_for_for_ever(machine: pytest.MonkeyPatch) -> None:
    machine.setattr(gpu, "ASK", "raise SystemExit(1)")
    machine.setattr(gpu, "WAIT_S", 0.2)
    assert gpu.resolved_device("auto", SystemClock()) == "cpu"
    machine.setattr(gpu, "SIGNS", ())  # no such machine: not waited for at all
    machine.setattr(gpu, "WAIT_S", 1e9)
    assert gpu.resolved_device("auto", SystemClock()) == "cpu"


def test_cuda_without_a_gpu_is_refused_and_tried_again(machine: pytest.MonkeyPatch) -> None:
    with pytest.raises(StartError, match="set device: auto") as problem:
        gpu.resolved_device("cuda:0", SystemClock())
    assert problem.value.temporary
    assert gpu.resolved_device("cpu", SystemClock()) == "cpu"
