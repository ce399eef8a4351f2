"""Scenes and recordings mapped and asked, with the toy encoder and with mini."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm
from onemap_simulator.replay.recorder import write_recording
from onemap_simulator.replay.recording import RecordedFrame
from onemap_simulator.scene.loading import load_scene
from onemap_tools.bench.scene import SceneBenchParams, run
from onemap_tools.bench.scene_tour import tour_poses
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_OK, EXIT_USAGE_ERROR
from tests.structure import ROOT
from tests.tools.bench.furnished import write_room
from tests.tools.recording.bags import RecordedRobot
from tests.tools.recording.test_replay import TOPICS, bag, drive

PHOTOGRAPHS = ROOT.parent / "shared" / "data" / "rgbd_study"
LABELS = ROOT / "tests" / "data" / "rgbd_study.yaml"


def bench(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["bench", "scene", *map(str, arguments)])


def named(document: dict[str, Any], name: str) -> dict[str, Any]:
    return next(dict(place) for place in document["places"] if place["name"] == name)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_room(tmp_path_factory.mktemp("scene") / "room.glb")


@pytest.mark.slow
def test_a_scene_file_is_judged_by_its_own_names(room: Path, tmp_path: Path) -> None:
    result = bench(room, "--places", "3", "--out", tmp_path / "out", "--json")
    assert result.exit_code == EXIT_OK
    document = json.loads(result.stdout.splitlines()[-1])
    assert (document["labels"], document["labelled"], document["frames"]) == (None, 7, 24)
    assert document["encoder_id"].startswith("mini-")
    assert json.loads((tmp_path / "out" / "scene.json").read_text()) == document
    assert len(list((tmp_path / "out").glob("*.png"))) == 8
    television = named(document, "television")
    assert television["mapped"]
    assert television["best_here"] > television["best_elsewhere"]


@pytest.mark.slow
def test_a_recording_is_judged_by_labels(room: Path, tmp_path: Path) -> None:
    scene, camera = load_scene(room), CameraParams()
    renderer, frames = Renderer(scene), []
    for pose in tour_poses(scene, camera, 1):
        view = renderer.render(pose, camera.intrinsics, width=camera.width, height=camera.height)
        depth_mm = measured_mm(view.depth_m, camera.min_depth_m, camera.max_depth_m)
        frames.append(RecordedFrame(view.rgb, depth_mm, pose))
    write_recording(tmp_path / "recording", frames, camera.intrinsics)
    labels = tmp_path / "labels.yaml"
    labels.write_text(
        "- {name: sofa, x: 4.5, y: 0.5, radius_m: 1.2}\n"
        "- {name: qwrtzpsdfg, x: 4.5, y: 0.5, radius_m: 1.2}\n"
    )
    result = bench(tmp_path / "recording", "--labels", labels)
    assert result.exit_code == EXIT_OK
    assert " of 2 places found" in result.stdout
    assert "8 frames" in result.stdout
    params = SceneBenchParams(tmp_path / "recording", labels)
    for frame in frames:
        frame.depth_mm[:] = 0
    write_recording(tmp_path / "blind", frames, camera.intrinsics)
    with pytest.raises(ValueError, match=r"nothing of .*blind could be mapped"):
        run(replace(params, path=tmp_path / "blind"))


ANYWHERE = "- {name: sofa, x: 1.0, y: 0.0, radius_m: 0.5}\n"


def robot_drive(folder: Path) -> Path:
    """A recording of four frames."""
    robot = RecordedRobot(folder)
    robot.begin()
    for number in range(4):
        robot.see(number)
        robot.update()
    return robot.end()


def test_a_recording_of_a_robot_is_judged_too(tmp_path: Path) -> None:
    path, labels = robot_drive(tmp_path), tmp_path / "labels.yaml"
    labels.write_text(ANYWHERE)
    assert run(SceneBenchParams(path, labels))["frames"] == 4
    result = bench(path, "--labels", labels, "--every", 3, "--json")
    assert result.exit_code == EXIT_OK
    assert json.loads(result.stdout.splitlines()[-1])["frames"] == 2
    result = bench(path)
    assert "is a recording, which names nothing: give --labels" in result.stderr


def test_a_place_outside_the_map_is_not_mapped(tmp_path: Path) -> None:
    path, labels, out = robot_drive(tmp_path), tmp_path / "labels.yaml", tmp_path / "out"
    labels.write_text(ANYWHERE + "- {name: bed, x: 90, y: 0.5, radius_m: 1.2}\n")
    result = bench(path, "--labels", labels, "--out", out)
    assert result.exit_code == EXIT_OK
    assert result.stdout.count("not mapped") == 1
    document = json.loads((out / "scene.json").read_text())
    x_min, y_min, x_max, y_max = document["bounds_m"]
    assert x_min < 1.0 < x_max < 90
    assert y_min < 0.0 < y_max
    assert (
        "\nNot mapped because outside the map, which reaches from "
        f"({x_min:.1f}, {y_min:.1f}) to ({x_max:.1f}, {y_max:.1f}) m: bed at (90, 0.5).\n"
    ) in result.stdout
    assert (named(document, "bed")["mapped"], named(document, "bed")["found"]) == (False, False)
    assert named(document, "sofa")["mapped"]
    assert {file.name for file in out.glob("*.png")} == {"scene.png", "sofa.png", "bed.png"}


def test_names_that_the_encoder_does_not_know_are_refused_before_a_frame_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_perception.encoders.mini.find_model_folder", lambda: None)
    robot = RecordedRobot(tmp_path, images=False)
    robot.begin()
    robot.see(0)
    path, labels = robot.end(), tmp_path / "labels.yaml"
    unknown = ANYWHERE.replace("sofa", "qwrtzpsdfg")
    labels.write_text(unknown * 2)
    result = bench(path, "--labels", labels)
    assert result.exit_code == EXIT_USAGE_ERROR
    assert result.stderr.startswith(
        f"{labels}: the encoder knows none of the labels' names: 'qwrtzpsdfg' is not among the "
    )
    assert len(result.stderr.splitlines()) == 1
    labels.write_text(unknown + ANYWHERE)
    assert "it holds no images" in bench(path, "--labels", labels).stderr


def test_a_name_that_the_encoder_does_not_know_is_not_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_perception.encoders.mini.find_model_folder", lambda: None)
    path, labels, out = robot_drive(tmp_path), tmp_path / "labels.yaml", tmp_path / "out"
    labels.write_text(ANYWHERE.replace("sofa", "qwrtzpsdfg") + ANYWHERE)
    result = bench(path, "--labels", labels, "--out", out)
    assert result.exit_code == EXIT_OK
    assert "Not asked for, unknown to the encoder: qwrtzpsdfg." in result.stdout
    assert {file.name for file in out.glob("*.png")} == {"scene.png", "sofa.png"}


def test_a_bag_of_ros_2_is_judged_with_the_topics_of_the_configuration(tmp_path: Path) -> None:
    path, labels = bag(tmp_path / "a.mcap", drive()), tmp_path / "labels.yaml"
    labels.write_text(ANYWHERE)
    config = tmp_path / "robot.yaml"
    config.write_text(json.dumps({"ros2": {"topics": TOPICS}}))
    result = bench(path, "--labels", labels, "--config", config, "--json")
    assert result.exit_code == EXIT_OK
    assert json.loads(result.stdout.splitlines()[-1])["frames"] == 3
    result = bench(path, "--labels", labels)
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "name the topics in --config" in result.stderr


def test_a_recording_without_images_is_one_sentence(tmp_path: Path) -> None:
    robot = RecordedRobot(tmp_path, images=False)
    robot.begin()
    robot.see(0)
    path, labels = robot.end(), tmp_path / "labels.yaml"
    labels.write_text(ANYWHERE)
    result = bench(path, "--labels", labels)
    assert result.exit_code == EXIT_USAGE_ERROR
    assert result.stderr == f"nothing of {path} could be mapped: it holds no images\n"
    path.write_bytes(b"no recording")
    assert "is not an MCAP file" in bench(path, "--labels", labels).stderr


def test_a_recording_needs_labels(tmp_path: Path) -> None:
    result = bench(tmp_path)
    assert result.exit_code == EXIT_USAGE_ERROR
    assert (
        "is a recording, which names nothing: give --labels, a file with [] for the map"
        in result.stderr
    )


def test_a_folder_without_frames_is_one_sentence(tmp_path: Path) -> None:
    result = bench(tmp_path, "--labels", LABELS)
    assert result.exit_code == EXIT_USAGE_ERROR
    assert len(result.stderr.splitlines()) == 1
    assert "frames.json" in result.stderr


def test_a_scene_without_names_needs_labels(tmp_path: Path) -> None:
    result = bench(write_room(tmp_path / "room.ply"))
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "has no named objects: give --labels" in result.stderr


@pytest.mark.skipif(not PHOTOGRAPHS.exists(), reason=f"no recording in {PHOTOGRAPHS}")
def test_the_photographs_are_measured() -> None:
    document = run(SceneBenchParams(PHOTOGRAPHS, LABELS))
    assert (document["frames"], document["labelled"], document["not_mapped"]) == (5, 17, 0)
    assert named(document, "sofa")["found"]
