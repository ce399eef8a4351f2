"""``onemap replay FILE.mcap``: the map of a recording, without a robot and without a bus."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from onemap_mapper.belief.map import BeliefMap, FieldRejected
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.service import TORCH_THREADS
from onemap_mapper.storage import map_file
from onemap_mapper.storage.snapshot import sha256_of, take
from onemap_perception.config import PerceptionConfig
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_shared.config import read, section
from onemap_shared.grid import GridTooLarge
from onemap_shared.messages import FeatureField, RgbdFrame
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.recording.bag_file import CUT_OFF, FIELDS, FRAMES, BagReader


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """The recording, and what is done with it. ``out``: where the map is written."""

    path: Path
    config: Path | None = None
    reencode: bool = False
    out: Path | None = None


@dataclass(slots=True)
class MapAgain:
    """A map that is computed again; rejected: frames that do not fit it."""

    belief: BeliefMap
    rejected: int = 0

    def fuse(self, frames: Iterable[FeatureField]) -> None:
        """Fuse all frames."""
        for frame in frames:
            try:
                self.belief.check_pose(frame.T_map_camera)
                self.belief.fuse(compute_update(frame, self.belief.params))
            except (FieldRejected, GridTooLarge):
                self.rejected += 1


def replay(options: ReplayOptions) -> dict[str, Any]:
    """Compute the map; one JSON object. CliError for what cannot be read or written."""
    sections, path = read(options.config), options.path
    params = section(sections, "mapper", MapperConfig).map
    torch.set_num_threads(TORCH_THREADS)
    made, reader = MapAgain(BeliefMap(params)), BagReader(path)
    if options.reencode:
        frames = (each.decode(RgbdFrame) for each in reader.messages() if each.topic == FRAMES.key)
        made.fuse(_encoded(frames, section(sections, "perception", PerceptionConfig)))
    else:
        stored = (each for each in reader.messages() if each.topic == FIELDS.key)
        made.fuse(each.decode(FeatureField) for each in stored)
    if not made.belief.store.count:
        what = "images" if options.reencode else "features"
        raise CliError(f"{path} holds no {what} to make a map of.")
    if options.out is not None:
        try:
            map_file.write(take(made.belief), options.out)
        except OSError as problem:
            raise CliError(f"Cannot write {options.out}: {problem.strerror}.") from problem
    return {
        "file": str(path),
        "cut_off": reader.cut_off,
        "reencoded": options.reencode,
        "encoder_id": made.belief.encoder_id,
        "frames_fused": made.belief.frames_fused,
        "cells": made.belief.store.count,
        "sha256": sha256_of(take(made.belief)),
        "problems": [f"{made.rejected} frames do not fit the map."] if made.rejected else [],
        "out": None if options.out is None else str(options.out),
    }


def _encoded(frames: Iterable[RgbdFrame], config: PerceptionConfig) -> Iterator[FeatureField]:
    """The frames with the features of the configured encoder."""
    observation = VarianceParams(config.variance)
    try:
        encoder = make_encoder(config.encoder)
        for frame in frames:
            yield feature_field(frame, encoder.encode(frame.rgb), encoder, observation)
    except BackendError as problem:
        raise CliError(f"{problem}.", EXIT_USAGE_ERROR) from problem


def describe(document: dict[str, Any]) -> list[str]:
    """The result for people, line by line."""
    lines = [
        f"A map of {document['cells']} cells from {document['frames_fused']} frames with encoder "
        f"{document['encoder_id']}, SHA-256 {document['sha256'][:16]}..."
    ]
    if document["cut_off"]:
        lines.append(f"{CUT_OFF} The map is made of what comes before that.")
    return [*lines, *document["problems"]]
