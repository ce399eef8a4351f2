"""Calibration of the encoder ``mini``: how a cosine becomes a score."""
# Touches files: calibration.

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

CALIBRATION_FILE = "calibration.json"


@dataclass(frozen=True, slots=True)
class Calibration:
    """Fitted on held-out apartments by ``onemap train mini``; fields as in ``calibration.json``.

    temperature: factor of the cosine in the softmax. expansion: weight of the nearest classes'
    embedding that is added to a query's own. sharpness: factor of the cosine in the softmax that
    weights those classes. synonym: cosine to the query from which a class or neutral word does
    not compete with it. floor: best score below which a query is answered "not here", measured
    by ``onemap bench queries``; 0: not measured. placed: highest cosine to any class below which
    a word counts as unlike all of them; 0.45 excludes nine in ten random strings of letters and,
    of the held-out synonyms, only "telly".
    """

    temperature: float
    expansion: float
    sharpness: float
    synonym: float
    floor: float = 0.0
    placed: float = 0.0


def load_calibration(folder: Path) -> Calibration:
    """Read ``calibration.json``; raises ValueError."""
    path = folder / CALIBRATION_FILE
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        return Calibration(**{name: float(value) for name, value in values.items()})
    except (OSError, ValueError, TypeError, AttributeError) as problem:
        raise ValueError(f"cannot read the calibration {path}: {problem}") from problem
