"""The benchmark of storage finds what rounding to the nearest loses."""

from __future__ import annotations

from onemap_tools.bench.storage import NEAREST, StorageOptions, run


def test_a_still_camera_shows_what_rounding_loses() -> None:
    options = StorageOptions(hours=0.25, noise=0.0, exchange_s=450.0, cells=4, channels=64)
    result = run(options)
    errors = {name: result[name]["similarity_error_max"] for name in ("float32", "float16")}
    assert errors["float32"] < 1e-4
    assert errors["float16"] < 0.01 < result[NEAREST]["similarity_error_max"]
    assert result["float16"]["changes_followed"] == 1
    assert 0 < result["float16"]["slowest_change_s"] < 450
