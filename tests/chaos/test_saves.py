"""A process is killed while it saves a map: the file is a whole one, the old or the new."""

from __future__ import annotations

import os
import random
import signal
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.view_log import SeenFrom
from onemap_mapper.frame.update import compute_update
from onemap_mapper.storage.map_file import read, write
from onemap_mapper.storage.snapshot import MapFileError, MapSnapshot, take
from tests.chaos.report import Attack
from tests.mapper import scenes

KILLS = 100
LONGEST_S = 0.06  # from the first save to the kill; a save takes about 10 ms
CELLS = 4000
SEED = 11


def large_map() -> MapSnapshot:
    """A map whose file takes a while to write."""
    params = scenes.params()
    belief = BeliefMap(params)
    belief.fuse(compute_update(scenes.field(0, scenes.pose(-0.5, 0.2)), params))
    small = take(belief)
    ones = np.ones(CELLS, np.float32)
    number = np.arange(CELLS, dtype=np.int32)
    return replace(
        small,
        cells=np.stack([number % 100, number // 100], axis=1),
        features=np.random.default_rng(SEED)
        .normal(size=(CELLS, small.header.dimension))
        .astype(small.features.dtype),
        confidence=ones,
        searched=ones,
        explored=ones,
        colours=None,
        heights=np.zeros((CELLS, small.heights.shape[1]), np.float32),
        seen=SeenFrom(
            np.zeros((0, 3)), np.full(CELLS, -1, np.int32), 0 * ones, np.zeros(CELLS, np.int64)
        ),
    )


def save_for_ever(snapshot: MapSnapshot, path: Path, started: int) -> None:
    """In a forked process: save again and again, one frame more each time."""
    try:
        os.write(started, b"1")
        count = snapshot.header.frames_fused
        while True:
            count += 1
            write(replace(snapshot, header=replace(snapshot.header, frames_fused=count)), path)
    finally:
        os._exit(1)  # never back into the test


def kill_while_saving(snapshot: MapSnapshot, path: Path, delay_s: float) -> None:
    """One saving process that lives for ``delay_s``."""
    heard, started = os.pipe()
    child = os.fork()
    if child == 0:
        save_for_ever(snapshot, path, started)
    os.read(heard, 1)
    threading.Event().wait(delay_s)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os.close(heard)
    os.close(started)


def test_kills_while_saving(attack: Attack, tmp_path: Path) -> None:
    path, snapshot, rng = tmp_path / "flat.npz", large_map(), random.Random(SEED)
    write(snapshot, path)
    newest, damaged, replaced = snapshot.header.frames_fused, 0, 0
    count = attack.attempts(KILLS)
    for _ in range(count):
        kill_while_saving(snapshot, path, rng.random() * LONGEST_S)
        try:
            fused = read(path).header.frames_fused
        except MapFileError:
            damaged += 1
            write(snapshot, path)
            continue
        replaced += fused != newest
        newest = fused
    attack.holds(
        f"{count} kills of a process that saves a map of {CELLS} cells",
        limit="0 files damaged",
        measured=f"{damaged} damaged, {replaced} times a newer one in place",
        held=damaged == 0,
    )
