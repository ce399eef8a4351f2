"""A library that is missing or does not fit is one sentence with what to do."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from onemap_perception.config import OpenClipConvNextParams, Tipsv2Params
from onemap_perception.detectors.networks import CocoNetwork, GroundingNetwork
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder

CPU = torch.device("cpu")
USERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "openclip_convnext": (
        "open_clip",
        lambda folder: make_encoder(OpenClipConvNextParams(model=str(folder))),
    ),
    "tipsv2": ("transformers", lambda folder: make_encoder(Tipsv2Params(model=str(folder)))),
    "coco": ("transformers", lambda folder: CocoNetwork(folder, CPU)),
    "open_vocabulary": (
        "transformers",
        lambda folder: GroundingNetwork(folder, CPU),
    ),
}


def without(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget that the library was imported."""
    for name in list(sys.modules):
        if name.split(".")[0] == library:
            monkeypatch.delitem(sys.modules, name)


@pytest.mark.parametrize("backend", USERS)
def test_a_missing_library_is_an_error_with_the_command_to_install_it(
    backend: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library, make = USERS[backend]
    without(library, monkeypatch)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(
        BackendError, match=f"{backend} needs {library}.*: pip install 'onemap"
    ) as error:
        make(tmp_path)
    assert "\n" not in str(error.value)
