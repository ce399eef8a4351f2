"""The training loop repeats itself, resumes, and learns."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from onemap_tools.train.data.text_targets import build_text_bank
from onemap_tools.train.network.backbone import EfficientNetLite0
from onemap_tools.train.network.mini_network import MiniNetwork
from onemap_tools.train.params import TrainParams
from onemap_tools.train.train_state import load_averaged_network
from onemap_tools.train.trainer import LOG_FILE, TrainingProgress, train_mini
from tests.structure import ROOT
from tests.tools.train.network.test_backbone import FROZEN, published
from tests.tools.train.tiny import VOCABULARY, embed, tiny_frames, tiny_params


def train(
    folder: Path, params: TrainParams, *, stop_at: int = 0, kill_at: int = 0
) -> tuple[MiniNetwork, list[TrainingProgress]]:
    """Train; ``stop_at`` interrupts after that step, as Ctrl-C would, ``kill_at`` ends us."""
    reports: list[TrainingProgress] = []

    def report(progress: TrainingProgress) -> None:
        reports.append(progress)
        if progress.step == stop_at:
            raise KeyboardInterrupt
        if progress.step == kill_at:
            os.kill(os.getpid(), signal.SIGKILL)

    network = train_mini(
        tiny_frames(),
        build_text_bank(VOCABULARY, embed),
        folder,
        params=params,
        device=torch.device("cpu"),
        report=report,
    )
    return network, reports


def weights_of(network: MiniNetwork) -> torch.Tensor:
    return torch.cat([value.flatten().float() for value in network.state_dict().values()])


def test_training_repeats_and_resumes(tmp_path: Path) -> None:
    whole, reports = train(tmp_path / "whole", tiny_params())
    assert [report.step for report in reports] == [1, 2, 3, 4]
    assert {report.steps for report in reports} == {4}
    assert torch.equal(weights_of(load_averaged_network(tmp_path / "whole")), weights_of(whole))
    other, _ = train(tmp_path / "other", tiny_params(seed=1))
    assert not torch.allclose(weights_of(other), weights_of(whole), rtol=1e-3, atol=1e-4)
    # Interrupted after step 3: what comes after the checkpoint of step 2 is repeated.
    broken = tmp_path / "broken"
    with pytest.raises(KeyboardInterrupt):
        train(broken, tiny_params(), stop_at=3)
    resumed, rest = train(broken, tiny_params())
    assert [report.step for report in rest] == [3, 4]
    torch.testing.assert_close(weights_of(resumed), weights_of(whole), rtol=1e-6, atol=1e-7)


@pytest.mark.slow
def test_a_killed_training_goes_on_from_its_checkpoint(tmp_path: Path) -> None:
    whole, _ = train(tmp_path / "whole", tiny_params())
    code = (
        "from pathlib import Path; from tests.tools.train.test_trainer import train; "
        "from tests.tools.train.tiny import tiny_params; "
        f"train(Path({str(tmp_path / 'killed')!r}), tiny_params(), kill_at=3)"
    )
    ended = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False, timeout=300)
    assert ended.returncode == -signal.SIGKILL
    resumed, rest = train(tmp_path / "killed", tiny_params())
    assert [report.step for report in rest] == [3, 4]
    torch.testing.assert_close(weights_of(resumed), weights_of(whole), rtol=1e-6, atol=1e-7)


def test_checkpoints_are_logged(tmp_path: Path) -> None:
    _, reports = train(tmp_path, tiny_params())
    lines = [json.loads(line) for line in (tmp_path / LOG_FILE).read_text().splitlines()]
    assert all(line.pop("step_s") > 0 for line in lines)
    assert lines == [
        {"step": r.step, "steps": 4, "loss": round(r.loss, 4)} for r in reports if r.step % 2 == 0
    ]


def test_training_starts_from_the_backbone_and_keeps_its_early_stages(tmp_path: Path) -> None:
    torch.manual_seed(7)
    backbone = EfficientNetLite0()
    file = published(backbone, tmp_path / "weights.pth")
    network, _ = train(tmp_path / "run", tiny_params(learning_rate=0.1, backbone_weights=file))
    source = backbone.state_dict()
    for name, tensor in network.backbone.state_dict().items():
        if name.endswith("num_batches_tracked"):
            continue
        same = torch.allclose(tensor, source[name], rtol=1e-4, atol=1e-6)
        assert same == name.startswith(FROZEN), name


def test_a_training_starts_from_the_averaged_network_of_another(tmp_path: Path) -> None:
    first, _ = train(tmp_path / "first", tiny_params(learning_rate=0.1))
    params = tiny_params(
        learning_rate=1e-9, seed=1, full_image_share=0.0, start_from=tmp_path / "first"
    )
    second, reports = train(tmp_path / "second", params)
    assert [report.step for report in reports] == [1, 2, 3]
    source = first.state_dict()
    for name, tensor in second.state_dict().items():
        if name.startswith("backbone.") or name.endswith(("weight", "bias")):
            torch.testing.assert_close(tensor, source[name], rtol=1e-3, atol=1e-4)


@pytest.mark.slow
def test_the_loss_falls(tmp_path: Path) -> None:
    params = tiny_params(steps=60, batch_size=4, weak_share=1.0, full_image_share=0.0)
    _, reports = train(tmp_path, params)
    assert reports[-1].loss < 0.8 * reports[0].loss
