"""Optional libraries: what comes of them where torchvision does not fit the installed torch."""

from __future__ import annotations

import pytest

from onemap_perception import errors
from onemap_perception.errors import TRANSFORMERS, BackendError, optional_import


def test_a_torchvision_that_cannot_be_imported_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(name: str) -> None:
        raise RuntimeError(f"{name} was compiled with a different CUDA version")

    monkeypatch.setattr(errors, "import_module", fail)
    with (
        pytest.raises(BackendError, match=r"torchvision was compiled.*: install the"),
        optional_import("transformers", TRANSFORMERS, backend="coco"),
    ):
        pass
