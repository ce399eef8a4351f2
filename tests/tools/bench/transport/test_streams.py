from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from onemap_perception.encoders.mini import MiniParams
from onemap_tools.bench.transport.benchmark import SETTINGS, THIN
from onemap_tools.bench.transport.streams import Stream, load_stream, make_stream, sizes_kb

pytestmark = pytest.mark.slow
IMAGES = 6


@pytest.fixture(scope="module")
def full() -> Stream:
    return make_stream(MiniParams(), (320, 240), IMAGES)


@pytest.fixture(scope="module")
def narrow() -> Stream:
    return make_stream(MiniParams(channels=128), (320, 240), IMAGES)


def test_a_stream_survives_its_file(full: Stream, tmp_path: Path) -> None:
    full.save(tmp_path / "s.npz")
    loaded = load_stream(tmp_path / "s.npz")
    frame = loaded.frame(IMAGES + 1, 7)
    np.testing.assert_array_equal(frame.rgb, full.rgb[1])
    field = loaded.field(frame)
    np.testing.assert_array_equal(field.features, full.features[1])
    assert (field.sequence, field.stamp_ns) == (IMAGES + 1, 7)


def test_thin_streams_fit_their_links(full: Stream, narrow: Stream) -> None:
    """The goals: 8 Hz in 30 Mbit/s, and 4 Hz in 10 Mbit/s, each way, with a fifth to spare."""
    for stream, hz, mbit_s in ((full, 8, 30), (narrow, 8, 30), (narrow, 4, 10)):
        for kb in sizes_kb(stream, THIN):
            assert 8e-3 * kb * hz < 0.8 * mbit_s
    raw = sizes_kb(full, SETTINGS["raw"].link)
    assert 8e-3 * raw[1] * 8 > 2 * 30  # which uncompressed fields do not
