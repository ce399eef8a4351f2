"""Pictures of one thing, as queries: what kind of file, how large, read from its first bytes.

Nothing is decoded here, so that a small file that claims to be huge costs nothing.
"""

from __future__ import annotations

MAX_IMAGE_BYTES = 512 * 1024  # a JPEG of 1920 x 1080; a crop of one thing takes a tenth of that
MIN_IMAGE_SIDE_PX, MAX_IMAGE_SIDE_PX = 16, 4096  # two patches of the smallest encoder; a 4K camera
PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"
NOT_FRAME_HEADERS = frozenset({0xC4, 0xC8, 0xCC})  # of the markers C0 to CF of a JPEG
WITHOUT_LENGTH = frozenset({0x01, *range(0xD0, 0xD8)})


def check_image(data: bytes) -> None:
    """Raise ValueError unless ``data`` begins as a PNG or JPEG of a size that is allowed."""
    if len(data) > MAX_IMAGE_BYTES:
        raise ValueError(
            f"the image has {len(data)} bytes; the limit is {MAX_IMAGE_BYTES}: send a smaller "
            "crop, or a JPEG"
        )
    size = image_size_px(data)
    if size is None:
        raise ValueError("the image is no PNG and no JPEG, or it is cut off: send one of these")
    if not MIN_IMAGE_SIDE_PX <= min(size) <= max(size) <= MAX_IMAGE_SIDE_PX:
        raise ValueError(
            f"the image has {size[0]} x {size[1]} pixels; each side must have "
            f"{MIN_IMAGE_SIDE_PX} to {MAX_IMAGE_SIDE_PX}: send a crop of one thing"
        )


def image_size_px(data: bytes) -> tuple[int, int] | None:
    """(width, height) as the header of a PNG or JPEG says; None if there is no such header."""
    if data.startswith(PNG):
        if data[12:16] != b"IHDR" or len(data) < 24:
            return None
        return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    return _jpeg_size_px(data) if data.startswith(JPEG) else None


def _jpeg_size_px(data: bytes) -> tuple[int, int] | None:
    """From the frame header: the first segment with a marker of C0 to CF that is none of others."""
    at = 2
    while at + 9 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF:  # padding
            at += 1
        elif marker in WITHOUT_LENGTH:
            at += 2
        elif 0xC0 <= marker <= 0xCF and marker not in NOT_FRAME_HEADERS:
            height, width = data[at + 5 : at + 7], data[at + 7 : at + 9]
            return int.from_bytes(width, "big"), int.from_bytes(height, "big")
        else:
            at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return None
