"""Configuration section ``replay``."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from onemap_shared.params import Params


class ReplayConfig(Params):
    """The recording to play, and its rate."""

    directory: Path = Field(
        default=Path("recording"), description="Folder with frames.json and PNG files."
    )
    rate_hz: float = Field(
        default=2.0,
        gt=0,
        le=60,
        description="Frames per second; 2 gives every stage time to use each frame.",
    )
