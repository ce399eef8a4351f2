"""The picture of docs/encoders.md: a photograph, the map that ``photo`` makes of its recording, and
where the map looks like three words.

``python -m onemap_tools.docs.photographs RECORDING docs/images/photographs.jpg``
"""
# Touches files: a recording, the picture.

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from onemap_gateway.present.render import Overlay, render_map
from onemap_mapper.params import MapParams
from onemap_mapper.query.replies import search_view
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import text_query
from onemap_perception.config import PhotoParams
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams
from onemap_shared.geometry import U8
from onemap_tools.bench.frames import map_of
from onemap_tools.bench.scene import recorded_frames

WORDS = ("sofa", "chair", "printer")
HEIGHT_PX, TITLE_PX, GAP_PX = 260, 28, 6
QUALITY = 85
WHITE = 255


def panel(image: U8, title: str) -> U8:
    """The image (H, W, 3) at the picture's height below its title."""
    width = round(image.shape[1] * HEIGHT_PX / image.shape[0])
    made = np.full((TITLE_PX + HEIGHT_PX, width + GAP_PX, 3), WHITE, np.uint8)
    made[TITLE_PX:, :width] = cv2.resize(image, (width, HEIGHT_PX), interpolation=cv2.INTER_AREA)
    cv2.putText(made, title, (2, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (0, 0, 0), 1, cv2.LINE_AA)
    return made


def main() -> None:
    """See above."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("file", type=Path)
    options = parser.parse_args()
    encoder = make_encoder(PhotoParams())
    frames = list(recorded_frames(options.recording, print))
    scores = MapScores(map_of(frames, encoder, VarianceParams(), MapParams()))
    panels = [panel(frames[-1].rgb, f"one of {len(frames)} photographs")]
    for word in ("", *WORDS):
        asked = (word,) if word else ()
        queries = [
            text_query(encoder.embed_text(asked), 0, MapParams().torch_device) for _ in asked
        ]
        view = search_view(scores.of(queries), text=word)
        panels.append(panel(render_map(view, Overlay()).image, word or "map"))
    picture = cv2.cvtColor(np.concatenate(panels, axis=1), cv2.COLOR_RGB2BGR)
    if not cv2.imwrite(str(options.file), picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY]):
        raise SystemExit(f"cannot write {options.file}")


if __name__ == "__main__":
    main()
