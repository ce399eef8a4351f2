"""Scenes and recordings mapped and asked, with the toy encoder and with mini."""

from __future__ import annotations

import errno
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from onemap_shared.geometry import U8
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm
from onemap_simulator.replay.recorder import write_recording
from onemap_simulator.replay.recording import RecordedFrame
from onemap_simulator.scene.loading import load_scene
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench import scene as bench_scene
from onemap_tools.bench.options import SceneBench
from onemap_tools.bench.scene import HEADINGS, MIN_CLEARANCE_M, tour_places, tour_poses
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_OK, EXIT_USAGE_ERROR
from tests.structure import ROOT
from tests.tools.bench.furnished import write_room
from tests.tools.recording.bags import RecordedRobot
from tests.tools.recording.test_replay import TOPICS, bag, drive

HEIGHT_M = 1.0
PHOTOGRAPHS = ROOT.parent / "shared" / "data" / "rgbd_study"
LABELS = ROOT / "tests" / "data" / "rgbd_study.yaml"


def bench(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["bench", "scene", *map(str, arguments)])


def run(**options: Any) -> dict[str, Any]:
    return bench_scene.run(SceneBench(**options), lambda _: None)


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
    for frame in frames:
        frame.depth_mm[:] = 0
    write_recording(tmp_path / "blind", frames, camera.intrinsics)
    with pytest.raises(ValueError, match=r"nothing of .*blind could be mapped"):
        run(path=tmp_path / "blind", labels=labels)


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
    assert run(path=path, labels=labels)["frames"] == 4
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


def test_a_scene_without_names_needs_labels(tmp_path: Path) -> None:
    result = bench(write_room(tmp_path / "room.ply"))
    assert result.exit_code == EXIT_USAGE_ERROR
    assert "has no named objects: give --labels" in result.stderr


@pytest.mark.skipif(not PHOTOGRAPHS.exists(), reason=f"no recording in {PHOTOGRAPHS}")
def test_the_photographs_are_measured() -> None:
    document = run(path=PHOTOGRAPHS, labels=LABELS)
    assert (document["frames"], document["labelled"], document["not_mapped"]) == (5, 17, 0)
    assert named(document, "sofa")["found"]


def decode_png(file: Path) -> U8:
    """BGR (H, W, 3) of a picture."""
    return np.asarray(cv2.imread(str(file)), np.uint8)


def test_without_places_the_picture_and_its_bounds_are_written(tmp_path: Path) -> None:
    path, labels, out = robot_drive(tmp_path), tmp_path / "labels.yaml", tmp_path / "out"
    labels.write_text("[]")
    result = bench(path, "--labels", labels, "--out", out)
    assert result.exit_code == EXIT_OK
    assert result.stdout.startswith("No place is labelled: the map was asked for nothing.\n")
    document = json.loads((out / "scene.json").read_text())
    assert (document["labelled"], document["places"]) == (0, [])
    assert {file.name for file in out.iterdir()} == {"scene.json", "scene.png"}
    height, width = decode_png(out / "scene.png").shape[:2]
    x_min, y_min, x_max, y_max = document["bounds_m"]
    assert width / (x_max - x_min) == pytest.approx(height / (y_max - y_min))


def test_a_folder_that_cannot_be_written_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    labels, blocked = tmp_path / "labels.yaml", tmp_path / "file"
    labels.write_text(ANYWHERE)
    blocked.touch()
    result = bench(tmp_path, "--labels", labels, "--out", blocked / "out")
    assert result.exit_code == EXIT_USAGE_ERROR
    assert result.stderr == (
        f"cannot write to {blocked / 'out'}: Not a directory; choose another --out\n"
    )
    monkeypatch.setattr(bench_scene, "TemporaryFile", fail)
    result = bench(tmp_path, "--labels", labels, "--out", tmp_path / "out")
    assert result.stderr == (
        f"cannot write to {tmp_path / 'out'}: Read-only file system; choose another --out\n"
    )


@pytest.fixture(scope="module")
def room_scene(room: Path) -> Scene:
    return load_scene(room)


def test_places_are_free_and_far_apart(room_scene: Scene) -> None:
    collision = CollisionMap.of(room_scene, HEIGHT_M)
    places = tour_places(room_scene, HEIGHT_M, 6)
    assert len(places) == 6
    for x, y in places.tolist():
        assert collision.clearance_m(x, y) >= MIN_CLEARANCE_M
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    assert apart[~np.eye(len(places), dtype=bool)].min() > 1.0
    np.testing.assert_allclose(places[0], room_scene.start[:2], atol=0.05)


def test_the_camera_turns_all_around_at_each_place(room_scene: Scene) -> None:
    camera = CameraParams()
    poses = np.array(tour_poses(room_scene, camera, 2))
    assert len(poses) == 2 * HEADINGS
    assert np.ptp(poses[:HEADINGS, 2, 3]) == pytest.approx(0.0, abs=1e-9)
    assert poses[:, 2, 3] == pytest.approx(camera.height_m)
    ahead = np.arctan2(poses[:HEADINGS, 1, 2], poses[:HEADINGS, 0, 2])
    turns = np.sort(np.mod(ahead, 2 * np.pi))
    assert np.diff(turns) == pytest.approx(2 * np.pi / HEADINGS, abs=1e-6)


def test_a_start_without_free_floor_is_one_sentence(room_scene: Scene) -> None:
    with pytest.raises(ValueError, match=r"no free floor around its start \(50\.00, 0\.00\)"):
        tour_places(replace(room_scene, start=(50.0, 0.0, 0.0)), HEIGHT_M, 3)
