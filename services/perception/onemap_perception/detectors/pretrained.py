"""Detectors of transformers from files of this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from onemap_perception.detectors.protocol import DetectorError


def pretrained(kind: Any, folder: Path, what: str) -> Any:
    """The model of this class, for inference; DetectorError unless every tensor was there."""
    try:
        model, report = kind.from_pretrained(
            folder, local_files_only=True, use_safetensors=True, output_loading_info=True
        )
    except Exception as problem:  # of transformers, safetensors and the disk
        reason = (str(problem).strip() or repr(problem)).splitlines()[0]
        raise DetectorError(f"{folder} holds no {what}: {reason}") from problem
    missing = sorted(report["missing_keys"])
    if missing:
        raise DetectorError(f"{folder} is of another architecture: it lacks {missing[0]}")
    return model.float().eval().requires_grad_(False)
