"""What a film keeps of one moment of a search."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_gateway.present.render import Overlay
from onemap_shared.geometry import U8
from onemap_shared.messages import Detections, SearchStatus, SearchView


@dataclass(frozen=True, slots=True)
class FilmMoment:
    """The state of a search, ``elapsed_s`` after it began.

    view: the map, with the similarity to the object that is searched. camera: RGB (H, W, 3);
    detections: in that image, None without any.
    """

    elapsed_s: float
    view: SearchView
    overlay: Overlay
    camera: U8
    detections: Detections | None
    status: SearchStatus
