"""One section of a file is replaced; comments and all other lines stay."""

from __future__ import annotations

from typing import Any

import pytest
import yaml

from onemap_tools.errors import CliError
from onemap_tools.model_setup.config_text import changed_lines, with_section

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
    return with_section(text, "perception", section or SECTION, source="robot.yaml")


def test_only_the_lines_that_differ_change() -> None:
    after = rewritten(TEXT)
    assert changed_lines(TEXT, after) == [
        "-     encoder: {backend: mini, channels: 9} # small",
        "+     encoder: {backend: tipsv2, model: google/tipsv2-b14} # small",
    ]
    assert yaml.safe_load(after) == {**yaml.safe_load(TEXT), "perception": SECTION}


def test_a_section_that_is_there_already_changes_nothing() -> None:
    once = rewritten(TEXT)
    assert rewritten(once) == once
    assert changed_lines(once, once) == []


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
    assert changed_lines(before, after) == [
        "-   token: ***",
        "-   read_token: ***",
        "-   name: a",
        "+   token: ***",
        "+   name: b",
    ]
