"""Detectors of other packages, found by their entry point."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import entry_points
from typing import Any

from onemap_perception.detectors.protocol import Detector, DetectorError

GROUP = "onemap.detectors"
PARTS = ("detector_id", "reads_features", "detect")


def load_plugin(name: str, options: Mapping[str, Any]) -> Detector:
    """What the entry point returns when it is called with the options; raises DetectorError."""
    installed = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in installed:
        there = ", ".join(sorted(installed)) or "none"
        raise DetectorError(f"no installed package has a detector {name!r} (there is: {there})")
    try:
        detector: Detector = installed[name].load()(**options)
    except Exception as problem:  # somebody else's code
        raise DetectorError(f"the detector {name!r} cannot be loaded: {problem!r}") from problem
    lacking = [part for part in PARTS if not hasattr(detector, part)]
    if lacking:
        raise DetectorError(f"the detector {name!r} lacks {', '.join(lacking)}")
    return detector
