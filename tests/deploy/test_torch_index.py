"""Which build of torch the set-up installs, and that the decision is fast."""

from __future__ import annotations

import importlib.util
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from types import ModuleType

import pytest

from tests.deploy.deployment import DEPLOY
from tests.structure import ROOT

SCRIPT = DEPLOY / "torch_index.py"


def load() -> ModuleType:
    spec = importlib.util.spec_from_file_location("torch_index", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


INDEX = load()
CPU = INDEX.CPU
PLAIN = INDEX.Machine("Linux", "x86_64", nvidia=False, torch="", own_settings=())


def decided(choice: str = "auto", *, reachable: bool = True, **changes: object) -> tuple[str, ...]:
    decision = INDEX.decide(choice, replace(PLAIN, **changes), lambda: reachable)
    assert decision.reason.endswith(".")
    assert "\n" not in decision.reason
    arguments: tuple[str, ...] = decision.arguments
    return arguments


def never_asked() -> bool:
    raise AssertionError("the index was asked for nothing")


@pytest.mark.parametrize("architecture", ["x86_64", "aarch64"])
def test_without_a_gpu_the_cpu_build_is_taken(architecture: str) -> None:
    assert decided(architecture=architecture) == CPU


def test_with_a_gpu_cuda_is_chosen_without_a_request() -> None:
    assert INDEX.decide("auto", replace(PLAIN, nvidia=True), never_asked).arguments == ()


def test_an_index_that_does_not_answer_is_left_out_and_named() -> None:
    assert decided(reachable=False) == ()
    assert INDEX.CPU_INDEX in INDEX.decide("auto", PLAIN, lambda: False).reason


@pytest.mark.parametrize(
    "changes",
    [
        {"torch": "2.13.0"},
        {"system": "Darwin", "architecture": "arm64"},
        {"architecture": "riscv64"},
        {"own_settings": ("PIP_INDEX_URL",)},
    ],
    ids=str,
)
def test_where_there_is_nothing_to_decide_nothing_is_added(changes: dict[str, object]) -> None:
    assert INDEX.decide("auto", replace(PLAIN, **changes), never_asked).arguments == ()


def test_settings_of_the_user_are_kept_and_reported() -> None:
    machine = replace(PLAIN, own_settings=("PIP_EXTRA_INDEX_URL",))
    assert "PIP_EXTRA_INDEX_URL" in INDEX.decide("auto", machine, never_asked).reason


def test_a_choice_overrules_what_is_found() -> None:
    assert INDEX.decide("cpu", replace(PLAIN, nvidia=True), never_asked).arguments == CPU
    assert INDEX.decide("cuda", PLAIN, never_asked).arguments == ()
    assert decided("cpu", torch="2.13.0") == ()  # what is installed stays


def test_a_driver_or_a_gpu_that_is_listed_is_an_nvidia_gpu(tmp_path: Path) -> None:
    driver, missing = tmp_path / "version", tmp_path / "missing"
    driver.write_text("NVRM version: 1")
    fails, lists, says_nothing = (
        (sys.executable, "-c", code)
        for code in ("raise SystemExit(9)", "print('GPU 0: H200')", "pass")
    )
    assert INDEX.has_nvidia(driver, fails)
    assert INDEX.has_nvidia(missing, lists)
    assert not INDEX.has_nvidia(missing, fails)
    assert not INDEX.has_nvidia(missing, says_nothing)
    assert not INDEX.has_nvidia(missing, (str(missing),))


@contextmanager
def served(status: int) -> Iterator[str]:
    """A web server on this machine that answers every HEAD with a status."""

    class Handler(BaseHTTPRequestHandler):
        def do_HEAD(self) -> None:
            self.send_response(status)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/"
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture(autouse=True)
def no_proxy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("no_proxy", "127.0.0.1")


def test_an_index_that_answers_is_reachable_and_an_error_page_is_none() -> None:
    with served(200) as url:
        assert INDEX.answers(url)
    with served(404) as url:
        assert not INDEX.answers(url)


def test_a_server_that_accepts_and_never_answers_is_given_up() -> None:
    """Returning at all is the promise: the connection stays open until after the verdict."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        assert not INDEX.answers(f"http://127.0.0.1:{silent.getsockname()[1]}/", limit_s=0.2)


def test_a_look_up_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """A name server that is silent blocks for longer than any socket's own limit."""
    hang = threading.Event()

    def never(*_: object, **__: object) -> None:
        hang.wait()
        raise OSError

    monkeypatch.setattr(INDEX.urllib.request, "urlopen", never)
    assert not INDEX.answers("http://127.0.0.1:9/", limit_s=0.2)
    hang.set()


def test_a_closed_port_and_an_unknown_host_do_not_answer() -> None:
    with socket.create_server(("127.0.0.1", 0)) as gone:
        port = gone.getsockname()[1]
    assert not INDEX.answers(f"http://127.0.0.1:{port}/")
    assert not INDEX.answers("nonsense")


def test_an_unknown_choice_is_refused() -> None:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "rocm"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == "TORCH is 'rocm'; it must be one of auto, cpu, cuda.\n"


def test_pip_gets_the_arguments_alone_and_people_the_reason() -> None:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "auto"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    assert done.stdout == "\n"  # torch is installed here
    assert "is installed already" in done.stderr


@pytest.mark.parametrize("target", ["setup-demo", "setup-dev"])
@pytest.mark.parametrize("choice", ["auto", "cpu", "cuda"])
def test_the_set_up_asks_and_obeys(target: str, choice: str, tmp_path: Path) -> None:
    """``make -n`` in a fresh environment: the script decides, pip gets what it printed."""
    command = ["make", "-n", target, f"VENV={tmp_path / 'venv'}"]
    if choice != "auto":
        command.append(f"TORCH={choice}")
    text = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    text = text.replace("\\\n", " ")
    (line,) = [line for line in text.splitlines() if "deploy/torch_index.py" in line]
    assert f"/bin/python deploy/torch_index.py {choice})" in line
    install = line.partition("&&")[2].split()
    assert "install" in install
    assert "$torch" in install


def test_a_choice_from_the_environment_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TORCH", "cpu")
    command = ["make", "-n", "setup-demo", f"VENV={tmp_path / 'venv'}"]
    text = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert "torch_index.py cpu)" in text


def test_the_dockerfile_takes_the_same_index() -> None:
    assert f"TORCH_INDEX={INDEX.CPU_INDEX}\n" in (DEPLOY / "service.Dockerfile").read_text()
