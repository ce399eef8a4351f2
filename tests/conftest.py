"""What the whole suite needs before the first test module is imported."""

from __future__ import annotations

import gc
import logging
import os
import sys
from collections.abc import Iterator
from typing import Any

import hypothesis
import pytest

from onemap_perception.errors import import_torchvision
from tests.process_state import ProcessState

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

# Small arrays gain nothing from threads, and workers of pytest-xdist share the cores. Read by
# numpy and torch when they are first imported; processes that tests start inherit it.
for variable in THREAD_VARIABLES:
    os.environ.setdefault(variable, "1")

# The time that an example takes says nothing where workers share the cores.
hypothesis.settings.register_profile("shared cores", deadline=None)
hypothesis.settings.load_profile("shared cores")


def pytest_configure(config: pytest.Config) -> None:
    """Tests import what imports it; the process that hands them out to workers does not."""
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        gc.disable()  # imports leave no garbage, and looking for it is a tenth of them
        import_torchvision()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """With several workers, begin with the files that hold slow tests: none is left for the end."""
    if hasattr(config, "workerinput"):
        first = {item.path for item in items if item.get_closest_marker("slow")}
        items.sort(key=lambda item: item.path not in first)


def pytest_collection_finish() -> None:
    """What was imported stays, over a million objects: garbage is among the rest."""
    gc.freeze()
    gc.enable()


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
