"""Optional libraries: what comes of them where torchvision does not fit the installed torch."""

from __future__ import annotations

import subprocess
import sys

import pytest

from onemap_perception import errors
from onemap_perception.errors import TRANSFORMERS, BackendError, optional_import
from tests.perception.tiny import needs_open_clip

# In a process of its own: this one's conftest has imported torchvision already.
IMPORTS = """
from onemap_perception.errors import optional_import
with optional_import("both", "", backend="any"):
    from open_clip.model import CLIP
    from transformers import Tipsv2Model
"""


@pytest.mark.slow
@needs_open_clip
def test_the_libraries_import_beside_any_build_of_torchvision() -> None:
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr


def test_a_torchvision_that_cannot_be_imported_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(name: str) -> None:
        raise RuntimeError(f"{name} was compiled with a different CUDA version")

    monkeypatch.setattr(errors, "import_module", fail)
    with (
        pytest.raises(BackendError, match=r"torchvision was compiled.*: install the"),
        optional_import("transformers", TRANSFORMERS, backend="coco"),
    ):
        pass
