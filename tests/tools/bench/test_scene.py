"""Labelled places, and scenes and recordings mapped and asked with mini."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.geometry import F32
from onemap_shared.grid import GridSpec
from onemap_shared.messages import SimilarityReply
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_simulator.replay.recording import RecordedFrame
from onemap_simulator.scene.loading import load_scene
from onemap_tools.bench import scene as bench_scene
from onemap_tools.bench.frames import rendered_frames
from onemap_tools.bench.options import SceneBench
from onemap_tools.bench.scene import (
    HEADINGS,
    MIN_CLEARANCE_M,
    PlaceLabel,
    lines,
    place_results,
    read_labels,
    totals,
    tour_poses,
)
from onemap_tools.cli.app import app
from onemap_tools.errors import EXIT_OK, EXIT_USAGE_ERROR
from tests.simulator.recordings import write_recording
from tests.structure import ROOT
from tests.tools.bench.furnished import write_room
from tests.tools.recording.bags import TOPICS, RecordedRobot, bag, drive

PHOTOGRAPHS = ROOT.parent / "shared" / "data" / "rgbd_study"
LABELS = ROOT / "tests" / "data" / "rgbd_study.yaml"
VOCABULARY = load_vocabulary(SHIPPED)
GRID = GridSpec(0.5, (0, 0), (20, 10))  # 10 x 5 m
ANYWHERE = "- {name: sofa, x: 1.0, y: 0.0, radius_m: 0.5}\n"
RUN = {"encoder_id": "mini", "frames": 5, "cells": 99, "seconds": 1.25, "bounds_m": GRID.bounds_m}


def place(name: str, x: float, y: float, radius_m: float) -> PlaceLabel:
    return PlaceLabel(name=name, x=x, y=y, radius_m=radius_m)


SOFA, OTHER_SOFA = place("sofa", 2.0, 2.0, 1.0), place("sofa", 8.0, 2.0, 1.0)
BED = place("bed", 5.0, 4.0, 0.8)
HIDDEN = place("oven", 9.5, 4.5, 0.3)  # where nothing was observed


def reply(text: str, *places: tuple[float, float, float]) -> SimilarityReply:
    """Answers at these places (x, y, score), best first; 0.1 elsewhere, one corner not seen."""
    scores: F32 = np.full(GRID.shape, 0.1, np.float32)
    scores[18:, 8:] = np.nan
    for x, y, score in places:
        scores[tuple(GRID.cells(np.array([x, y])))] = score
    centres = np.array([place[:2] for place in places], np.float32).reshape(-1, 2)
    best = np.array([place[2] for place in places], np.float32)
    extents, ones = np.concatenate([centres, centres], axis=1), np.ones_like(best)
    return SimilarityReply(
        *(text, 1, 1, "e", centres, extents, best, ones, GRID, scores),
        last_seen_ns=np.zeros(len(best), np.int64),
        best_views=np.full((len(best), 3), np.nan, np.float32),
        heights_m=np.full((len(best), 2), np.nan, np.float32),
    )


def test_totals_count_places_and_first_answers() -> None:
    labels = [SOFA, OTHER_SOFA, BED, HIDDEN, place("gizmo", 2.0, 2.0, 1.0)]
    replies = {
        "sofa": reply("sofa", (8.0, 2.0, 0.9), (2.2, 2.2, 0.7)),
        "bed": reply("bed", (1.0, 1.0, 0.9), (5.0, 4.0, 0.6)),
        "oven": reply("oven"),
        "gizmo": None,
    }
    results = place_results(labels, replies, VOCABULARY)
    hidden, unknown = results[3:]
    assert (hidden["mapped"], hidden["best_here"], hidden["looks_like"]) == (False, None, None)
    assert (unknown["known"], unknown["mapped"], unknown["found"]) == (False, True, False)
    counts = totals(labels, results, replies)
    assert counts == {
        "labelled": 5,
        "found": 3,
        "not_mapped": 1,
        "names": 4,
        "first_answer_right": 1,
        "first_answer_wrong": 1,
        "without_answer": 2,
        "unknown_words": ["gizmo"],
    }
    told = lines({**counts, **RUN, "places": results})
    assert told[0].split()[:3] == ["name", "x", "y"]
    assert [line.split()[-1] for line in told[4:6]] == ["-", "0.70"]
    assert "not mapped" in told[4]
    assert "unknown word" in told[5]
    assert told[-3].startswith("3 of 5 places found; of 4 names the first answer is right for 1")
    assert told[-2:] == [
        "Not asked for, unknown to the encoder: gizmo.",
        "mini, 5 frames, 99 cells, 1.2 s",
    ]


def labels_file(folder: Path, text: str) -> Path:
    path = folder / "labels.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "should be a valid list; it must be a list of places with name, x, y, radius_m"),
        ("- {x: 1, y: 1, radius_m: 1}", "entry 1: name Field required"),
        ("- {name: a, x: 1, y: 1, radius_m: 1, z: 2}", "entry 1: z Extra inputs"),
        ("- {name: a, x: 1, y: .nan, radius_m: 1}", "entry 1: y Input should be"),
        ("- {name: a, x: 1, y: 1, radius_m: 0}", "entry 1: radius_m Input should be greater"),
        ("- {name: a, x: 1", "is not valid YAML"),
    ],
)
def test_a_wrong_entry_is_named(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=r"labels\.yaml") as error:
        read_labels(labels_file(tmp_path, text))
    assert reason in str(error.value)
    with pytest.raises(ValueError, match=r"cannot read .*none\.yaml: No such file"):
        read_labels(tmp_path / "none.yaml")
    assert len(read_labels(LABELS)) == 17  # of the photographs


def bench(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["bench", "scene", *map(str, arguments)])


def refused(*arguments: object) -> str:
    result = bench(*arguments)
    assert result.exit_code == EXIT_USAGE_ERROR
    assert len(result.stderr.splitlines()) == 1
    return result.stderr


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
    frames = [
        RecordedFrame(frame.rgb, frame.depth_mm, frame.T_map_camera)
        for frame, _ in rendered_frames(scene, camera, tour_poses(scene, camera, 1))
    ]
    write_recording(tmp_path / "recording", frames, camera.intrinsics)
    labels = labels_file(tmp_path, ANYWHERE + ANYWHERE.replace("sofa", "qwrtzpsdfg"))
    result = bench(tmp_path / "recording", "--labels", labels)
    assert result.exit_code == EXIT_OK
    assert " of 2 places found" in result.stdout
    assert "8 frames" in result.stdout
    for frame in frames:
        frame.depth_mm[:] = 0
    write_recording(tmp_path / "blind", frames, camera.intrinsics)
    with pytest.raises(ValueError, match=r"nothing of .*blind could be mapped: its frames have no"):
        run(path=tmp_path / "blind", labels=labels)


def robot_drive(folder: Path, *, images: bool = True) -> Path:
    """A recording of four frames."""
    robot = RecordedRobot(folder, images=images)
    robot.begin()
    for number in range(4):
        robot.see(number)
        robot.update()
    return robot.end()


def test_a_recording_of_a_robot_is_judged_and_places_outside_its_map_are_told(
    tmp_path: Path,
) -> None:
    path, out = robot_drive(tmp_path), tmp_path / "out"
    labels = labels_file(tmp_path, ANYWHERE + "- {name: bed, x: 90, y: 0.5, radius_m: 1.2}\n")
    assert run(path=path, labels=labels, every=3)["frames"] == 2
    result = bench(path, "--labels", labels, "--out", out)
    assert result.exit_code == EXIT_OK
    assert result.stdout.count("not mapped") == 1
    assert "\nNot mapped because outside the map, which reaches from" in result.stdout
    document = json.loads((out / "scene.json").read_text())
    assert document["frames"] == 4
    assert (named(document, "bed")["mapped"], named(document, "sofa")["mapped"]) == (False, True)
    assert {file.name for file in out.glob("*.png")} == {"scene.png", "sofa.png", "bed.png"}
    assert "is a recording, which names nothing: give --labels" in refused(path)


def test_without_places_the_picture_and_its_bounds_are_written(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = bench(robot_drive(tmp_path), "--labels", labels_file(tmp_path, "[]"), "--out", out)
    assert result.exit_code == EXIT_OK
    assert result.stdout.startswith("No place is labelled: the map was asked for nothing.\n")
    document = json.loads((out / "scene.json").read_text())
    assert (document["labelled"], document["places"]) == (0, [])
    assert {file.name for file in out.iterdir()} == {"scene.json", "scene.png"}
    height, width = np.asarray(cv2.imread(str(out / "scene.png"))).shape[:2]
    x_min, y_min, x_max, y_max = document["bounds_m"]
    assert width / (x_max - x_min) == pytest.approx(height / (y_max - y_min))


def test_what_cannot_be_mapped_or_asked_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_perception.encoders.mini.find_model_folder", lambda: None)
    path, labels = robot_drive(tmp_path, images=False), labels_file(tmp_path, ANYWHERE)
    nothing = f"nothing of {path} could be mapped: it holds no images\n"
    assert refused(path, "--labels", labels) == nothing
    unknown = ANYWHERE.replace("sofa", "qwrtzpsdfg")
    assert refused(path, "--labels", labels_file(tmp_path, unknown * 2)).startswith(
        f"{labels}: the encoder knows none of the labels' names: 'qwrtzpsdfg' is not among the "
    )
    assert refused(path, "--labels", labels_file(tmp_path, unknown + ANYWHERE)) == nothing
    path.write_bytes(b"no recording")
    assert "is not an MCAP file" in refused(path, "--labels", labels)
    (blocked := tmp_path / "file").touch()
    assert refused(path, "--out", blocked / "out").endswith("/out: Not a directory\n")
    unnamed = write_room(tmp_path / "room.ply")
    assert "has no named objects: give --labels" in refused(unnamed)


def test_a_bag_of_ros_2_is_judged_with_the_topics_of_the_configuration(tmp_path: Path) -> None:
    path, labels = bag(tmp_path / "a.mcap", drive()), labels_file(tmp_path, ANYWHERE)
    config = tmp_path / "robot.yaml"
    config.write_text(json.dumps({"ros2": {"topics": TOPICS}}))
    assert run(path=path, labels=labels, config=config)["frames"] == 3
    assert "(ros2.topics.depth), which may be" in refused(path, "--labels", labels)


@pytest.mark.skipif(not PHOTOGRAPHS.exists(), reason=f"no recording in {PHOTOGRAPHS}")
def test_the_photographs_are_measured() -> None:
    document = run(path=PHOTOGRAPHS, labels=LABELS)
    assert (document["frames"], document["labelled"], document["not_mapped"]) == (5, 17, 0)
    assert named(document, "sofa")["found"]


def test_the_camera_turns_all_around_at_places_that_are_free_and_far_apart(room: Path) -> None:
    scene, camera = load_scene(room), CameraParams()
    poses = np.array(tour_poses(scene, camera, 6)).reshape(6, HEADINGS, 4, 4)
    assert poses[..., 2, 3] == pytest.approx(camera.height_m)
    collision = CollisionMap.of(scene, camera.height_m)
    places = poses[..., :2, 3].mean(axis=1)
    assert all(collision.clearance_m(x, y) >= MIN_CLEARANCE_M for x, y in places.tolist())
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    assert apart[~np.eye(6, dtype=bool)].min() > 1.0
    np.testing.assert_allclose(places[0], scene.start[:2], atol=0.05)
    turns = np.sort(np.mod(np.arctan2(poses[0, :, 1, 2], poses[0, :, 0, 2]), 2 * np.pi))
    assert np.diff(turns) == pytest.approx(2 * np.pi / HEADINGS, abs=1e-6)
    with pytest.raises(ValueError, match=r"no free floor around its start \(50\.00, 0\.00\)"):
        tour_poses(replace(scene, start=(50.0, 0.0, 0.0)), camera, 3)
