"""``onemap replay FILE.mcap``: the map of a recording, without a robot and without a bus."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
from pydantic import ValidationError

from onemap_mapper.config import MapperConfig
from onemap_mapper.storage import map_file
from onemap_mapper.storage.snapshot import sha256_of, take
from onemap_perception.config import PerceptionConfig
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams
from onemap_shared.config import read, section
from onemap_shared.messages import RgbdFrame
from onemap_tools.bag.bag_file import BagError, is_ros2
from onemap_tools.bag.rebuild import (
    MapHistory,
    MapRebuild,
    encoded_again,
    problems_of,
    read_history,
    rebuilt,
    recorded_frames,
)
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError, requires_extra

if TYPE_CHECKING:
    from onemap_tools.bag.ros2_frames import Ros2Bag


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """The recording, and what is done with it. ``out``: where the map is written."""

    path: Path
    config: Path | None = None
    reencode: bool = False
    out: Path | None = None


def replay(options: ReplayOptions) -> dict[str, Any]:
    """Compute the map again; one JSON object. CliError for what cannot be read or written."""
    bag: Ros2Bag | None = None
    try:
        if is_ros2(options.path):
            options = replace(options, reencode=True)
            bag = _open_ros2(options)
        history = read_history(options.path)
        params = _mapper_config(options, history)
        torch.set_num_threads(params.threads)
        if options.reencode:
            frames = recorded_frames(options.path) if bag is None else bag.frames()
            made = _encoded(options, frames, params)
        else:
            made = rebuilt(options.path, history, params)
    except (BagError, BackendError) as problem:
        sentence = str(problem)
        raise CliError(f"{sentence[0].upper()}{sentence[1:]}.", EXIT_USAGE_ERROR) from problem
    if not made.belief.store.count:
        what = "images" if options.reencode else "features and map revisions"
        raise CliError(f"{options.path} holds no {what} of which a map could be made.")
    if options.out is not None:
        _write(made, options.out)
    document = _document(options, history, made)
    document["problems"] += bag.problems if bag is not None else []
    return document


def _open_ros2(options: ReplayOptions) -> Ros2Bag:
    """A bag of ROS 2, whose messages need packages that OneMap's own recordings do not."""
    with requires_extra("ros2", "A bag of ROS 2"):
        from onemap_ros2.config import Ros2Config
        from onemap_tools.bag.ros2_frames import Ros2Bag
    return Ros2Bag(options.path, section(read(options.config), "ros2", Ros2Config))


def _mapper_config(options: ReplayOptions, history: MapHistory) -> MapperConfig:
    """The settings of the mapper that was recorded; those of --config if images are encoded."""
    if not history.digests or (options.reencode and options.config is not None):
        return section(read(options.config), "mapper", MapperConfig)
    try:
        config = MapperConfig.model_validate_json(history.digests[0].settings)
    except ValidationError as problem:
        raise BagError(
            f"{options.path} was recorded with settings of the mapper that this version does not "
            f"know: {'.'.join(map(str, problem.errors()[0]['loc']))}"
        ) from problem
    if config.device.startswith("cuda") and not torch.cuda.is_available():
        return config.model_copy(update={"device": "cpu"})
    return config


def _encoded(
    options: ReplayOptions, frames: Iterable[RgbdFrame], params: MapperConfig
) -> MapRebuild:
    perception = section(read(options.config), "perception", PerceptionConfig)
    encoder = make_encoder(perception.encoder)
    return encoded_again(frames, encoder, VarianceParams(perception.variance), params)


def _write(made: MapRebuild, out: Path) -> None:
    try:
        map_file.write(take(made.belief), out)
    except OSError as problem:
        raise CliError(f"Cannot write {out}: {problem.strerror}.") from problem


def _document(options: ReplayOptions, history: MapHistory, made: MapRebuild) -> dict[str, Any]:
    problems = problems_of(history, made)
    if not options.reencode and not made.compared:
        problems.append("No digest of the map could be compared.")
    return {
        "file": str(options.path),
        "cut_off": history.cut_off,
        "reencoded": options.reencode,
        "encoder_id": made.belief.encoder_id,
        "frames_fused": made.belief.frames_fused,
        "cells": made.belief.store.count,
        "sha256": sha256_of(take(made.belief)),
        "compared": made.compared,
        "equal": made.equal,
        "first_difference": made.first_difference,
        "queries": {"compared": made.asked.compared, "equal": made.asked.equal},
        "same": None if not made.compared else made.compared == made.equal,
        "problems": problems,
        "out": None if options.out is None else str(options.out),
    }


def describe(document: dict[str, Any]) -> list[str]:
    """The result for people, line by line."""
    lines = [
        f"A map of {document['cells']} cells from {document['frames_fused']} frames with encoder "
        f"{document['encoder_id']}, SHA-256 {document['sha256'][:16]}..."
    ]
    if document["same"]:
        lines.append(
            f"Bit for bit the recorded one: all {document['compared']} digests are the same."
        )
    elif document["compared"]:
        lines.append(
            f"It is not the recorded one: {document['compared'] - document['equal']} of "
            f"{document['compared']} digests differ, first at revision "
            f"{document['first_difference']}."
        )
    if compared := document["queries"]["compared"]:
        same = document["queries"]["equal"]
        lines.append(f"{same} of {compared} queries were answered as in the recording.")
    return [*lines, *document["problems"]]
