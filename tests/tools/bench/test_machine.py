"""What times are measured by."""

from __future__ import annotations

import time

import pytest
import torch

from onemap_tools.bench.machine import CPU, clock_of, device_facts, wall_clock

GPU = torch.device("cuda", 1)


def test_a_gpu_is_timed_when_it_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[torch.device] = []
    monkeypatch.setattr(torch.cuda, "synchronize", waited.append)
    for clock in (clock_of(GPU, 1), wall_clock(GPU)):
        assert clock() <= clock()
    assert waited == [GPU] * 4


def test_a_thread_that_computes_alone_is_timed_by_the_processor() -> None:
    assert clock_of(CPU, 1) is time.process_time
    assert clock_of(CPU, 2) is wall_clock(CPU) is time.perf_counter
    assert device_facts(CPU) == {"device": "cpu"}
