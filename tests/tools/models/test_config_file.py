"""The file that is changed: read, checked before anything is fetched, replaced as a whole."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Any

import pytest
import yaml

from onemap_tools.errors import CliError
from onemap_tools.models import config_file
from onemap_tools.models.choice import choose


def drafted(path: Path, *names: str) -> config_file.ConfigDraft:
    return config_file.draft(path, choose(names or ["tipsv2"]), "cpu", allow_remote_code=False)


def test_a_file_keeps_its_permissions_and_its_link(tmp_path: Path) -> None:
    path, link = tmp_path / "robot.yaml", tmp_path / "link.yaml"
    path.write_text("gateway: {token: secret}  # mine\n")
    path.chmod(0o600)
    link.symlink_to(path)
    config_file.write(drafted(link))
    assert link.is_symlink()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert path.read_text().startswith("gateway: {token: secret}  # mine\nperception:\n")


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    with pytest.raises(CliError, match="folder is a folder; name a file"):
        drafted(tmp_path / "folder")
    for parent in ("nowhere", "file"):
        with pytest.raises(CliError, match=f"cannot be written: there is no folder .*{parent}"):
            drafted(tmp_path / parent / "robot.yaml")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_file_that_is_read_only_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text("log: {}\n")
    path.chmod(0o400)
    with pytest.raises(CliError, match="it is read-only"):
        config_file.check_writable(path)


def test_a_file_that_somebody_changed_meanwhile_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    made = drafted(path)
    path.write_text("log: {level: debug}\n")
    with pytest.raises(CliError, match="was changed by somebody else meanwhile"):
        config_file.write(made)
    assert path.read_text() == "log: {level: debug}\n"


def test_the_environment_does_not_reach_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ONEMAP__PERCEPTION__FRAME_TIMEOUT_S", "7")
    assert "variance" not in drafted(tmp_path / "robot.yaml").after


TEXT = """\
# the robot in the hall
bus:
    connect: [tcp/10.0.0.1:7447]  # the router
perception:
    # the camera is slow
    variance: paper
    encoder: {backend: mini, channels: 9} # small
gateway:
    token: "0123"
    hosts:
        - a
        - b
log: {level: info}
"""
SECTION = {"variance": "paper", "encoder": {"backend": "tipsv2", "model": "google/tipsv2-b14"}}


def rewritten(text: str, section: dict[str, Any] | None = None) -> str:
    return config_file.with_section(text, "perception", section or SECTION, source="robot.yaml")


def test_only_the_lines_that_differ_change() -> None:
    after = rewritten(TEXT)
    assert config_file.changed_lines(TEXT, after) == [
        "-     encoder: {backend: mini, channels: 9} # small",
        "+     encoder: {backend: tipsv2, model: google/tipsv2-b14} # small",
    ]
    assert yaml.safe_load(after) == {**yaml.safe_load(TEXT), "perception": SECTION}


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "perception:\n", "log: {}\n# end\n"])
def test_a_section_that_was_not_there_is_added(text: str) -> None:
    after = rewritten(text)
    assert yaml.safe_load(after)["perception"] == SECTION
    assert [line for line in text.splitlines() if line.startswith("#")] == [
        line for line in after.splitlines() if line.startswith("#")
    ]


def test_words_that_two_versions_of_yaml_read_differently_stay() -> None:
    text = "replay: {loop: on, start: 010, name: 1_000}\n"
    after = rewritten(text)
    assert after.startswith(text)
    assert yaml.safe_load(after)["replay"] == yaml.safe_load(text)["replay"]


@pytest.mark.parametrize(
    "text",
    [
        "mapper: &same {variance: paper}\nperception: *same\n",  # both would change
        "log: {level: info}\nlog: {level: debug}\n",
    ],
)
def test_a_file_that_would_lose_something_is_refused(text: str) -> None:
    with pytest.raises(CliError, match=r"write this section into it yourself:\nperception:\n  "):
        rewritten(text)


def test_secrets_are_not_shown() -> None:
    before = "gateway:\n  token: old\n  read_token: x\n  name: a\n"
    after = "gateway:\n  token: new\n  name: b\n"
    assert config_file.changed_lines(before, after) == [
        "-   token: ***",
        "-   read_token: ***",
        "-   name: a",
        "+   token: ***",
        "+   name: b",
    ]
