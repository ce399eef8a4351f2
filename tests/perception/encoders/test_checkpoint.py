"""Files that are no checkpoints, and files that would run code."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from onemap_perception.encoders.checkpoint import fingerprint, load_weights, read_weights
from onemap_perception.errors import BackendError


class Payload:
    """What an attacker would save: unpickling it calls a function."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return (print, ("this must never run",))


def test_a_pickled_payload_is_refused_unread(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "evil.pth"
    torch.save({"model": Payload()}, path)
    with pytest.raises(BackendError, match="not a checkpoint of tensors alone"):
        read_weights(path)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("name", ["w.pth", "w.safetensors"])
@pytest.mark.parametrize("content", [b"", b"not a checkpoint", b"PK\x03\x04 cut off"])
def test_corrupt_files_are_refused(name: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(BackendError, match=f"{name} is not a checkpoint"):
        read_weights(path)


def test_many_missing_tensors_are_counted() -> None:
    model = torch.nn.Sequential(torch.nn.Linear(2, 2), torch.nn.Linear(2, 2))
    with pytest.raises(BackendError, match=r"lacks 0\.weight, 0\.bias, 1\.weight and 1 more"):
        load_weights(model, {}, Path("w.pth"))


def test_a_tensor_of_another_shape_is_named() -> None:
    model = torch.nn.Linear(2, 3)
    weights = {"weight": torch.zeros(3, 5), "bias": torch.zeros(3)}
    with pytest.raises(BackendError, match=r"weight has shape \(3, 5\); expected \(3, 2\)"):
        load_weights(model, weights, Path("w.pth"))


def test_the_fingerprint_follows_values_and_names_not_order() -> None:
    a, b = torch.arange(4.0), torch.ones(2, 2)
    both = fingerprint([("a", a), ("b", b)])
    assert both == fingerprint([("b", b), ("a", a)])
    assert both == fingerprint([("a", a.half()), ("b", b)])  # the same values
    assert both != fingerprint([("a", b), ("b", a)])
    assert both != fingerprint([("a", a + 1), ("b", b)])
