"""An image in a JSON body: base64, or a data URL as browsers make it."""

from __future__ import annotations

from base64 import b64decode
from typing import Annotated

from pydantic import BeforeValidator, WithJsonSchema

from onemap_shared.messages import MAX_IMAGE_BYTES, check_image

DATA_URL = "data:image/"


def image_bytes(value: object) -> bytes:
    """The PNG or JPEG that a member of a body holds; ValueError says what is wrong with it."""
    if not isinstance(value, str):
        raise ValueError("'image' must be a string: a PNG or JPEG in base64")
    head, separator, rest = value.partition(";base64,")
    encoded = rest if separator and head.startswith(DATA_URL) else value
    try:
        data = b64decode("".join(encoded.split()), validate=True)
    except ValueError:
        raise ValueError("'image' is no base64: send a PNG or JPEG in base64") from None
    check_image(data)
    return data


ImageMember = Annotated[
    bytes,
    BeforeValidator(image_bytes),
    WithJsonSchema(
        {
            "type": "string",
            "contentEncoding": "base64",
            "description": "A crop of one thing instead of a text: PNG or JPEG in base64, 16 to "
            f"4096 pixels a side, at most {MAX_IMAGE_BYTES // 1024} kB.",
        }
    ),
]
