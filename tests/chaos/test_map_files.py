"""Mutated map files: each is refused with a sentence or loaded as a whole, in bounded memory."""

from __future__ import annotations

import json
import random
import tracemalloc
from collections import Counter
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.storage import map_file
from onemap_mapper.storage.objects import NO_OBJECTS
from onemap_mapper.storage.snapshot import MapFileError, restore, take
from tests.chaos.report import Attack
from tests.chaos.test_wire import mutated
from tests.mapper import scenes
from tests.mapper.finds import object_find

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

FILES = 500
SEED = 11
LIMIT_MB = 32.0  # of what one file of 0.3 MB makes the mapper allocate; numpy's, not torch's
PARAMS = scenes.params()
VALUES: tuple[Any, ...] = (
    *(None, True, "", "x", "\ud800", "\x00", "a" * 100_000, [], {}, [[[]]]),
    *(0, -1, 1, 2**31, 2**63, 2**70, -(2**63), 10**400, 1e308, 1e-320, 0.05, -0.05),
    *(float("nan"), float("inf")),
)
DTYPES = ("int8", "uint8", "int32", "int64", "float16", "float32", "float64", "complex64", "U3")
FILLS = (0, 1, -1, 7, 1e-38, 1e30, 3e38, np.nan, np.inf, -np.inf, 2**31 - 1)


def saved(path: Path) -> bytes:
    """A file of a small map with a found object."""
    belief = BeliefMap(PARAMS)
    belief.fuse(compute_update(scenes.field(0, scenes.pose(-0.5, 0.2)), PARAMS))
    objects = NO_OBJECTS.with_find(object_find("bed"), "00ff00ff")
    map_file.write(take(belief, objects), path)
    return path.read_bytes()


def with_other_header(content: dict[str, NDArray], rng: random.Random) -> dict[str, NDArray]:
    """One field of the header gets another value, is missing, or the text is mutated."""
    header = json.loads(str(content["header"]))
    name = rng.choice([*header, "another"])
    kind = rng.randrange(4)
    if kind == 0:
        header.pop(name, None)
    elif kind == 1:
        text = mutated(json.dumps(header).encode(), rng).decode("latin-1").replace("\x00", " ")
        return content | {"header": np.array(text)}
    else:
        header[name] = rng.choice(VALUES)
    return content | {"header": np.array(json.dumps(header))}


def with_other_array(content: dict[str, NDArray], rng: random.Random) -> dict[str, NDArray]:
    """One array gets another type, shape, order or some other values, or is missing."""
    name = rng.choice([name for name in content if name != "header"])
    array, kind = content[name].copy(), rng.randrange(6)
    if kind == 0:
        return {key: value for key, value in content.items() if key != name}
    if kind == 1:
        with np.errstate(all="ignore"):
            array = array.astype(rng.choice(DTYPES))
    elif kind == 2:
        array = array.reshape(rng.choice([(-1,), (1, *array.shape), (*array.shape, 1)]))
    elif kind == 3:
        array = array[: rng.randrange(len(array) + 1)] if rng.random() < 0.5 else array[:0]
    elif kind == 4:
        array = np.repeat(array, rng.choice([2, 3]), axis=0)
    elif array.size:
        with np.errstate(all="ignore"):
            fill = np.asarray(rng.choice(FILLS)).astype(array.dtype)
        array.reshape(-1)[rng.randrange(array.size) :: rng.choice([1, 97])] = fill
    return content | {name: array}


def attacked(data: bytes, content: dict[str, NDArray], rng: random.Random) -> bytes:
    """A file with one mutation, of its bytes or of what it says."""
    kind = rng.randrange(3)
    if kind == 0:
        return mutated(data, rng)
    changed = (with_other_header if kind == 1 else with_other_array)(content, rng)
    file, save = BytesIO(), np.savez_compressed if rng.random() < 0.1 else np.savez
    arrays: dict[str, Any] = changed
    save(file, **arrays)
    return file.getvalue()


def outcome(path: Path) -> str:
    """What loading this file does."""
    try:
        content = map_file.read(path, max_cells=PARAMS.max_cells)
        restored = restore(content, PARAMS, encoder_id="", first_revision=1)
        map_file.write(take(restored, content.objects), path)  # so it can be saved again
        return "loaded"
    except MapFileError:
        return "refused"
    except Exception as problem:
        return type(problem).__name__


def test_mutated_map_files(attack: Attack, tmp_path: Path) -> None:
    data, rng = saved(tmp_path / "whole.npz"), random.Random(SEED)
    count = attack.attempts(FILES)
    with np.load(BytesIO(data)) as archive:
        content = {name: archive[name] for name in archive.files}
    outcomes, peak_mb, path = Counter[str](), 0.0, tmp_path / "attacked.npz"
    tracemalloc.start()
    try:
        for _ in range(count):
            path.write_bytes(attacked(data, content, rng))
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            outcomes[outcome(path)] += 1
            peak_mb = max(peak_mb, (tracemalloc.get_traced_memory()[1] - before) / 1e6)
    finally:
        tracemalloc.stop()
    escaped = {name: n for name, n in outcomes.items() if name not in ("loaded", "refused")}
    attack.holds(
        f"{count:,} mutated map files",
        limit=f"0 escape as another error, {LIMIT_MB:g} MB",
        measured=f"{outcomes['refused']} refused, {outcomes['loaded']} loaded, "
        f"{sum(escaped.values())} escaped {escaped or ''}; {peak_mb:.1f} MB",
        held=not escaped and peak_mb < LIMIT_MB,
    )
