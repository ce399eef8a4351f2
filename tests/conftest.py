"""What the whole suite needs before the first test module is imported."""

from __future__ import annotations

import importlib.util
import logging
import os
import sys
from collections.abc import Iterator
from typing import Any

import hypothesis
import pytest

from tests.process_state import ProcessState

SCHEMAS = (
    "nms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor",
    "qnms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor",
)
KEPT: list[Any] = []  # a library's definitions last as long as the object
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

# Small arrays gain nothing from threads, and workers of pytest-xdist share the cores. Read by
# numpy and torch when they are first imported; processes that tests start inherit it.
for variable in THREAD_VARIABLES:
    os.environ.setdefault(variable, "1")


def make_torchvision_importable() -> None:
    """Declare the operators that torchvision wants at import and a CPU torch lacks.

    open_clip and timm import torchvision; the registry's is built for CUDA and fails beside a
    CPU build of torch. Nothing here ever calls these operators.
    """
    if importlib.util.find_spec("torchvision") is None or importlib.util.find_spec("torch") is None:
        return
    try:
        import torchvision  # noqa: F401
    except RuntimeError:
        import torch

        library: Any = torch.library.Library("torchvision", "DEF")  # type: ignore[no-untyped-call]
        for schema in SCHEMAS:
            library.define(schema)
        KEPT.append(library)


make_torchvision_importable()

# The time that an example takes says nothing where workers share the cores.
hypothesis.settings.register_profile("shared cores", deadline=None)
hypothesis.settings.load_profile("shared cores")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """With several workers, begin with the files that hold slow tests: none is left for the end."""
    if hasattr(config, "workerinput"):
        first = {item.path for item in items if item.get_closest_marker("slow")}
        items.sort(key=lambda item: item.path not in first)


@pytest.fixture(autouse=True)
def _process_as_before() -> Iterator[None]:
    """What a test leaves in the process makes it fail, and not one of those after it."""
    before = ProcessState.now()
    yield
    left = before.restore()
    assert not left, f"the test changed what others use as well: {', '.join(left)}"


@pytest.fixture(autouse=True)
def _torch_threads_as_before() -> Iterator[None]:
    """Services set them for their process; tests that come later have those of the suite."""
    torch: Any = sys.modules.get("torch")
    before = torch.get_num_threads() if torch is not None else 1
    yield
    torch = sys.modules.get("torch")
    if torch is not None and torch.get_num_threads() != before:
        torch.set_num_threads(before)


@pytest.fixture(autouse=True)
def _logging_as_before() -> Iterator[None]:
    """A command that sets up logging in this process must not make later tests' commands log."""
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    yield
    root.setLevel(level)
    for handler in [each for each in root.handlers if each not in handlers]:
        root.removeHandler(handler)
    for handler in [each for each in handlers if each not in root.handlers]:
        root.addHandler(handler)
