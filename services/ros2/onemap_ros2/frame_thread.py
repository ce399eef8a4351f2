"""Makes frames in a thread of its own, of the newest images: the loop that relays commands never
waits for an image."""
# Talks: the thread that makes frames.

from __future__ import annotations

from onemap_ros2.frame_images import FrameImages
from onemap_shared.clock import Clock
from onemap_shared.messages import RgbdFrame

Made = RgbdFrame | ValueError  # what was wrong with the images, instead of a frame


class FrameThread:
    """One pair of images at a time; a newer one takes the place of that which waits."""

    def __init__(self, clock: Clock) -> None:
        self._changed = clock.condition()
        self._images: FrameImages | None = None
        self._made: Made | None = None
        self._closed = self._busy = False
        clock.thread("frames", self._run)

    def offer(self, images: FrameImages) -> None:
        """Make a frame of these next; returns at once."""
        with self._changed:
            self._images = images
            self._changed.notify_all()

    def take(self) -> Made | None:
        """The newest frame that was made since the last call; None without one."""
        with self._changed:
            made, self._made = self._made, None
            return made

    def wait_idle(self) -> None:
        """Wait until a frame was made of all that was offered."""
        with self._changed:
            self._changed.wait_for(lambda: self._images is None and not self._busy)

    def close(self) -> None:
        """Make no more frames; does not wait for the one that is being made."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _run(self) -> None:
        while (images := self._next()) is not None:
            made: Made
            try:
                made = images.frame()
            except ValueError as problem:
                made = problem
            with self._changed:
                self._made, self._busy = made, False
                self._changed.notify_all()

    def _next(self) -> FrameImages | None:
        with self._changed:
            self._changed.wait_for(lambda: self._images is not None or self._closed)
            images, self._images = self._images, None
            self._busy = images is not None
            return None if self._closed else images
