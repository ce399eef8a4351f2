"""``onemap models use`` with tiny random checkpoints and a hub on loopback."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml
from typer.testing import CliRunner

from onemap_perception import model_store
from onemap_perception.config import PerceptionConfig
from onemap_perception.factory import make_encoder
from onemap_shared.config import load
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_FAILED, EXIT_OK, EXIT_USAGE_ERROR
from onemap_tools.models import setup as memory
from onemap_tools.models.setup import device_memory
from tests.perception import tiny
from tests.perception.local_hub import COMMIT, LocalHub, ServedFile, serve_hub, use_hub
from tests.structure import ROOT
from tests.test_documents import commands
from tests.tools.recording.bags import RecordedRobot

pytest.importorskip("huggingface_hub", reason="needs huggingface_hub (extra openclip)")
TIPS, COCO, OPEN = "google/tipsv2-b14", "PekingU/rtdetr_v2_r18vd", "iSEE-Laboratory/llmdet_tiny"
CLIP = "laion/CLIP-convnext_large_d_320.laion2B-s29B-b131K-ft-soup"
WEIGHTS = "model.safetensors"
pytestmark = pytest.mark.timeout(300)  # importing transformers takes a minute on a busy machine


class Answer(NamedTuple):
    """How a command ended, what it printed, and its JSON object."""

    code: int
    text: str
    document: dict[str, Any]


@pytest.fixture(scope="module")
def checkpoints(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders of tiny checkpoints."""
    root = tmp_path_factory.mktemp("checkpoints")
    tiny.tipsv2_folder(root / "tips")
    tiny.rtdetr_folder(root / "coco")
    tiny.owl_folder(root / "open")
    return root


@pytest.fixture
def hub(checkpoints: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalHub]:
    """A hub that serves them under the names of real ones; the working folder is empty."""
    with serve_hub() as hub:
        for repo, name in ((TIPS, "tips"), (COCO, "coco"), (OPEN, "open")):
            hub.add(repo, checkpoints / name)
        use_hub(hub, tmp_path / "cache", monkeypatch)
        (tmp_path / "work").mkdir()
        monkeypatch.chdir(tmp_path / "work")
        yield hub


def use(*arguments: str) -> Answer:
    """Run the command; nobody is at a terminal."""
    result = CliRunner().invoke(app, ["models", "use", *arguments, "--json"])
    lines = result.stdout.splitlines()
    return Answer(result.exit_code, result.output, json.loads(lines[-1]) if lines else {})


def refused(*arguments: str, code: int = EXIT_FAILED) -> str:
    """The sentence of a command that must refuse."""
    answer = use(*arguments)
    assert answer.code == code, answer.text
    return str(answer.document["error"])


def downloads(hub: LocalHub) -> int:
    """How often weights were asked for."""
    return sum(len(files[WEIGHTS].ranges) for files in hub.models.values())


def test_one_command_makes_a_configuration_that_runs(hub: LocalHub) -> None:
    answer = use("tipsv2", "--device", "cpu", "--yes")
    assert answer.code == EXIT_OK, answer.text
    assert f"{TIPS} for tipsv2" in answer.text
    assert "licence: Apache-2.0 (its page states apache-2.0)" in answer.text
    assert answer.document["note"].startswith("Scores of this encoder are not fitted with labels: ")
    for model in (TIPS, COCO, OPEN):
        assert f"https://huggingface.co/{model}/tree/{COMMIT}" in answer.text
    assert "Memory of cpu: about 1.0 GB needed" in answer.text
    printed = CliRunner().invoke(app, ["models", "use", "tipsv2", "--device", "cpu", "--yes"])
    assert yaml.safe_load(printed.stdout) == {"perception": answer.document["perception"]}
    Path("robot.yaml").write_text(printed.stdout)
    _, _, config = load(Path("robot.yaml"), "perception", PerceptionConfig)
    assert make_encoder(config.encoder).encoder_id.startswith("tipsv2-")


@tiny.needs_open_clip
def test_the_papers_encoder_with_a_detector(
    hub: LocalHub, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hub.add(CLIP, tiny.open_clip_folder(tmp_path / "clip"), "mit")
    answer = use("openclip_convnext", "coco", "--device", "cpu", "--yes")
    assert answer.code == EXIT_OK, answer.text
    assert answer.document["perception"]["encoder"]["model"] == CLIP


def test_what_is_not_allowed_is_refused_before_anything_is_fetched(hub: LocalHub) -> None:
    sentence = refused("coco", "--device", "cpu", code=EXIT_USAGE_ERROR)
    assert sentence.endswith("read them, then give --yes.")
    hub.gated.add(COCO)
    assert "given only to accounts that accepted its licence" in refused("coco", "--yes")
    assert downloads(hub) == 0


def test_a_device_that_is_too_small_is_refused_before_anything_is_fetched(hub: LocalHub) -> None:
    tensor = {"dtype": "F16", "shape": [10**12], "data_offsets": [0, 2 * 10**12]}
    header = json.dumps({"a": tensor}).encode()
    content = struct.pack("<Q", len(header)) + header
    hub.models[COCO][WEIGHTS] = ServedFile(content, large=True)
    sentence = refused("coco", "--device", "cpu", "--yes")
    assert sentence.startswith(
        "Too small: the models need about 8001.0 GB of memory on cpu; it has"
    )
    assert downloads(hub) == 0


def test_a_version_that_comes_while_the_user_reads_is_not_fetched(
    hub: LocalHub, checkpoints: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = memory._describe

    def reads(*parts: Any) -> None:
        shown(*parts)
        newer = tmp_path / "newer"
        shutil.copytree(checkpoints / "coco", newer)
        (newer / "config.json").write_text("{}")
        hub.push(COCO, newer, "b" * 40)

    monkeypatch.setattr(memory, "_describe", reads)
    answer = use("coco", "--device", "cpu", "--yes")
    assert answer.code == EXIT_OK, answer.text
    assert f"https://huggingface.co/{COCO}/tree/{COMMIT}" in answer.text
    config = model_store.locate(COCO) / "config.json"
    assert config.read_bytes() == (checkpoints / "coco" / "config.json").read_bytes()


def test_a_checkpoint_that_does_not_load_is_refused(hub: LocalHub, checkpoints: Path) -> None:
    hub.add(TIPS, checkpoints / "coco")
    assert "is of another architecture" in refused("tipsv2", "coco", "--device", "cpu", "--yes")


@pytest.mark.slow
def test_the_page_on_photographs_can_be_followed(hub: LocalHub, tmp_path: Path) -> None:
    """Its commands as they stand there, but for the robot, the question and the services."""
    page = (ROOT / "docs" / "encoders.md").read_text(encoding="utf-8")
    every = [shlex.split(line)[1:] for line in commands(page)]
    assert (every[0], every[-1][:2]) == (["models", "list"], ["train", "mini"])
    lines = every[1:-1]
    assert [" ".join(line[:2]) for line in lines] == [
        "models use",
        "up --config",
        "record drive.mcap",
        "replay drive.mcap",
        "up --only",
        "map load",
        "query sofa",
    ]
    done = CliRunner().invoke(app, [*lines[0], "--yes", "--device", "cpu"])
    assert done.exit_code == EXIT_OK, done.output
    Path("robot.yaml").write_text(done.stdout)
    robot = RecordedRobot(tmp_path)
    robot.begin()
    robot.see(0, 1)
    robot.end().rename("drive.mcap")
    Path("maps").mkdir()
    mapped = CliRunner().invoke(app, lines[3])
    assert mapped.exit_code == EXIT_OK, mapped.output
    assert "tipsv2-" in mapped.output
    assert Path("maps/drive.npz").exists()


@pytest.mark.parametrize("typed", ["n", "", "y"])
def test_on_a_terminal_the_licence_is_asked_for(
    hub: LocalHub,
    typed: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    person, terminal = os.openpty()
    os.write(person, f"{typed}\n".encode())
    with os.fdopen(terminal) as stdin, monkeypatch.context() as patched:
        patched.setattr(sys, "stdin", stdin)
        with pytest.raises(SystemExit) as ended:
            app(["models", "use", "coco", "--device", "cpu"])
    os.close(person)
    out, err = capsys.readouterr()
    assert "licence: Apache-2.0" in err
    assert "Accept the licences and fetch the models?" in err
    if typed == "y":
        assert ended.value.code in (None, EXIT_OK)
        assert out.startswith("perception:\n  detector:\n    backend: coco\n")
        return
    assert ended.value.code == EXIT_FAILED
    assert "Not accepted: nothing was fetched." in err
    assert downloads(hub) == 0
    assert out == ""


def test_the_limit_of_a_container_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "CGROUP", tmp_path)
    (tmp_path / "memory.max").write_text("50000000\n")
    (tmp_path / "memory.current").write_text("20000000\n")
    assert device_memory("cpu") == (50_000_000, 30_000_000)
    (tmp_path / "memory.max").write_text("max\n")
    assert device_memory("cpu").total_bytes > 50_000_000
