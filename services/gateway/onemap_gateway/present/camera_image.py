"""The camera image with its detections."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_gateway.present.canvas import draw_text
from onemap_gateway.present.palette import Rgb
from onemap_shared.geometry import U8
from onemap_shared.messages import Detections

BOX: Rgb = (255, 190, 92)
LABEL_TOP_PX = 16  # lowest row of a label at the upper edge: it is not cut off there


def annotate_detections(rgb: U8, detections: Detections | None) -> U8:
    """A copy of the image (H, W, 3) with a labelled box around each detection."""
    image = np.array(rgb)
    if detections is None:
        return image
    limit = 2 * max(image.shape)  # a box may leave the image, but not OpenCV's integers
    boxes = np.rint(np.clip(detections.boxes_px, -limit, limit)).astype(int)
    for name, score, (x0, y0, x1, y1) in zip(
        detections.names, detections.scores, boxes.tolist(), strict=True
    ):
        cv2.rectangle(image, (x0, y0), (x1, y1), BOX, 2, cv2.LINE_AA)
        draw_text(image, f"{name} {score:.2f}", (max(x0, 2), max(y0 - 5, LABEL_TOP_PX)), BOX)
    return image


def encode_jpeg(image: U8, quality: int) -> bytes:
    """JPEG of an RGB image, ``quality`` in percent."""
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    _, data = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), options)
    return data.tobytes()
