"""What the adapter adds to a frame is measured on frames that it makes."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from onemap_tools.bench import ros2
from onemap_tools.cli.app import app


def test_every_form_is_made_and_raw_images_are_copied_once() -> None:
    result = ros2.run(2)
    assert {name: form["copies"] for name, form in result["forms"].items()} == {
        "rgb8 + 16UC1": "1",
        "bgr8 + 32FC1": ros2.PROCESSED,
        "JPEG + compressedDepth": ros2.PROCESSED,
        "rgb8 + separate 16UC1": ros2.PROCESSED,
    }
    assert all(0 < form["min_ms"] <= form["p50_ms"] for form in result["forms"].values())


def test_a_form_that_makes_no_frame_is_no_measurement() -> None:
    form = ros2.image_forms(np.random.default_rng(0))["rgb8 + 16UC1"]
    broken = ros2.ImageForm({}, form.color, form.depth[:200])
    with pytest.raises(ValueError, match="makes no frame"):
        ros2.measure(broken, 1)


def test_the_command_prints_each_form() -> None:
    done = CliRunner().invoke(app, ["bench", "ros2", "--frames", "1", "--json"])
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout.splitlines()[-1])
    assert document["benchmark"] == "ros2"
    assert len(document["forms"]) == 4
