"""What a map holds as one number, by which two maps are found equal bit for bit."""

from __future__ import annotations

import hashlib
import json
import platform
from dataclasses import asdict

import numpy as np
import torch

from onemap_mapper.config import MapperConfig
from onemap_mapper.snapshot import MapSnapshot
from onemap_shared.messages import MapDigest

ARRAYS = (
    "cells",
    "features",
    "confidence",
    "searched",
    "explored",
    "driving_cells",
    "evidence",
    "clear",
)


def sha256_of(snapshot: MapSnapshot) -> str:
    """Of the header and of every array with its dtype and shape; found objects do not count."""
    digest = hashlib.sha256(json.dumps(asdict(snapshot.header), sort_keys=True).encode())
    for name in ARRAYS:
        array = np.ascontiguousarray(getattr(snapshot, name))
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


def digest_of(snapshot: MapSnapshot, *, revision: int, config: MapperConfig) -> MapDigest:
    """The digest of a map, with what is needed to compute the same map again."""
    header = snapshot.header
    return MapDigest(
        revision=revision,
        sequence=header.sequence,
        stamp_ns=header.stamp_ns,
        encoder_id=header.encoder_id,
        frames_fused=header.frames_fused,
        sha256=sha256_of(snapshot),
        settings=config.model_dump_json(exclude={"map_folder"}),
        versions=versions(),
    )


def versions() -> str:
    """The libraries and the processor that a map's last bits depend on."""
    return f"torch {torch.__version__}, numpy {np.__version__}, {platform.machine()}"
