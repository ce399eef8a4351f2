"""How many standing queries with an image are open at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.schemas import QueryRequest

# Half of the images whose embedding the mapper keeps: with more than it keeps, each look at the
# map would have to be embedded anew, and single queries need some of them too.
MAX_IMAGE_STREAMS = 16


class ImageStreams:
    """Places for the standing queries with an image of one robot; for one event loop."""

    def __init__(self) -> None:
        self.open = 0

    @contextmanager
    def place(self, request: QueryRequest) -> Iterator[None]:
        """Hold a place as long as the request is followed, if it has an image.

        Raises HttpProblem ``busy`` if all are taken.
        """
        if request.image is None:
            yield
            return
        if self.open >= MAX_IMAGE_STREAMS:
            raise HttpProblem(
                "busy",
                f"{self.open} standing queries with an image are open, and no more are possible: "
                "close one of them, or ask now and then with POST /v1/queries.",
                service="gateway",
            )
        self.open += 1
        try:
            yield
        finally:
            self.open -= 1
