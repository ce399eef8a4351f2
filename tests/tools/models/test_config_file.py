"""The file that is changed: read, checked before anything is fetched, replaced as a whole."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest
import yaml

from onemap_tools.errors import CliError
from onemap_tools.models import config_file
from onemap_tools.models.choice import choose


def drafted(path: Path, *names: str) -> config_file.ConfigDraft:
    return config_file.draft(path, choose(names or ["tipsv2"]), "cpu")


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
        with pytest.raises(CliError, match=f"cannot be written: .*{parent}"):
            drafted(tmp_path / parent / "robot.yaml")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_file_that_is_read_only_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text("log: {}\n")
    path.chmod(0o400)
    with pytest.raises(CliError, match="it is read-only"):
        config_file.check_writable(path)


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
# the page
gateway:
    token: "0123"
log: {level: info, words: on, number: 010}
"""
SECTION = {"variance": "paper", "encoder": {"backend": "tipsv2", "model": "google/tipsv2-b14"}}


def rewritten(text: str) -> str:
    return config_file.with_section(text, SECTION, Path("robot.yaml"))


@pytest.mark.parametrize(
    "text", [TEXT, TEXT.replace("perception:", "other:"), "perception: {}", ""]
)
def test_the_section_is_replaced_or_added_and_all_else_stays(text: str) -> None:
    after = rewritten(text)
    assert yaml.safe_load(after) == {**(yaml.safe_load(text) or {}), "perception": SECTION}
    own = config_file.BLOCK.sub("", text).splitlines() if text == TEXT else []
    assert [line for line in after.splitlines() if line in own] == own
    assert rewritten(after) == after


@pytest.mark.parametrize(
    "text",
    [
        "mapper: &same {variance: paper}\nperception: *same\nlog: *same\n'perception': {}\n",
        "{perception: {variance: paper}}\n",
        "perception: {}\nlog: {level: info}\nperception: {}\n",
        "log: |\n perception:\nperception: {\nvariance: paper}\n",
    ],
)
def test_a_file_that_would_lose_something_is_refused(text: str) -> None:
    with pytest.raises(CliError, match=r"write this section into it yourself:\nperception:\n  "):
        rewritten(text)
