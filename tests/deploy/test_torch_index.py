"""Which build of torch the set-up installs, and that the decision is fast."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest

from tests.deploy.deployment import DEPLOY, script

INDEX: Any = script("torch_index")
PLAIN = INDEX.Machine("Linux", "x86_64", nvidia=False, torch="", own_settings=())
CPU = INDEX.CPU


def never_asked() -> bool:
    raise AssertionError("the index was asked for nothing")


@pytest.mark.parametrize(
    ("choice", "changes", "reachable", "arguments", "reason"),
    [
        ("auto", {}, True, CPU, "there is no NVIDIA GPU here"),
        ("auto", {"architecture": "aarch64"}, True, CPU, "there is no NVIDIA GPU here"),
        ("auto", {}, False, (), f"{INDEX.CPU_INDEX} does not answer"),
        ("auto", {"nvidia": True}, None, (), "there is an NVIDIA GPU"),
        ("auto", {"torch": "2.13.0"}, None, (), "2.13.0 is installed already"),
        ("auto", {"system": "Darwin", "architecture": "arm64"}, None, (), "one for Darwin"),
        ("auto", {"architecture": "riscv64"}, None, (), "what PyPI has for riscv64"),
        ("auto", {"own_settings": ("PIP_INDEX_URL",)}, None, (), "your PIP_INDEX_URL"),
        ("cpu", {"nvidia": True}, None, CPU, "as asked for"),
        ("cpu", {"torch": "2.13.0"}, None, (), "installed already"),  # and stays
        ("cuda", {}, None, (), "as asked for"),
    ],
)
def test_the_decision_is_explained_in_a_sentence(
    choice: str, changes: dict[str, Any], reachable: bool | None, arguments: Any, reason: str
) -> None:
    """None for ``reachable``: the index is not asked."""
    ask = never_asked if reachable is None else lambda: reachable
    decision = INDEX.decide(choice, PLAIN._replace(**changes), ask)
    assert decision.arguments == arguments
    assert reason in decision.reason
    assert decision.reason.endswith(".")
    assert "\n" not in decision.reason


@pytest.mark.parametrize(
    ("choice", "code", "stdout", "reason"),
    [
        ("rocm", 2, "", "TORCH is 'rocm'; it must be one of auto, cpu, cuda.\n"),
        ("auto", 0, "\n", "is installed already"),  # torch is, here
    ],
)
def test_pip_gets_the_arguments_alone_and_people_the_reason(
    choice: str, code: int, stdout: str, reason: str
) -> None:
    command = [sys.executable, str(DEPLOY / "torch_index.py"), choice]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (code, stdout)
    assert reason in done.stderr
