"""A link in virtual time: in order and without gaps, as TCP is; late, slow, full, lossy or cut."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from onemap_tools.virtual.scheduler import VirtualWorld

RESENT_S = (0.2, 1.6)  # after which TCP sends anew what was lost: at first, and at most
SENDS_BYTES = 400_000.0  # that wait on a link which sends anew: in the kernel's buffer and Zenoh's


@dataclass(slots=True)
class Link:
    """One direction between a session and the router.

    loss: how probably what is sent has to be sent anew, each time. queue_bytes: of what is
    published, what waits beyond it is dropped, as Zenoh drops what is congested. cut: nothing
    arrives; what was sent meanwhile does afterwards, unless the session has ended.
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    loss: float = 0.0
    bytes_per_s: float = math.inf
    queue_bytes: float = math.inf
    cut: bool = False


@dataclass(slots=True)
class Lane:
    """What is on its way over a link, in order: one connection."""

    link: Link
    free_ns: int = 0  # when what was sent before has left
    last_ns: int = 0  # when the newest arrives
    leaving: deque[tuple[int, int]] = field(default_factory=deque)  # when, and how many bytes
    coming: deque[tuple[int, Callable[[], object]]] = field(
        default_factory=deque
    )  # bytes, what then
    held: deque[Callable[[], object]] = field(default_factory=deque)  # by a cut link
    number: int = 0  # of the connection, and of the link's states

    def send(
        self, world: VirtualWorld, nbytes: int, arrive: Callable[[], object], *, drops: bool = False
    ) -> None:
        """Send; drops: rather than that it waits behind too much."""
        link = self.link
        while self.leaving and self.leaving[0][0] <= world.now_ns:
            self.leaving.popleft()
        if drops and sum(each for _, each in self.leaving) + nbytes > link.queue_bytes:
            return
        lost_s, again_s = 0.0, RESENT_S[0]
        while link.loss and world.rng.random() < link.loss:
            lost_s, again_s = lost_s + again_s, min(2 * again_s, RESENT_S[1])
        self.free_ns = max(world.now_ns, self.free_ns) + int(nbytes / link.bytes_per_s * 1e9)
        jitter_s = link.jitter_s * world.rng.random() if link.jitter_s else 0.0
        flight_ns = int((link.delay_s + jitter_s) * 1e9)
        self.last_ns = max(self.free_ns + int(lost_s * 1e9) + flight_ns, self.last_ns)
        left_ns = max(self.last_ns - flight_ns, self.free_ns)  # the kernel may forget it
        if left_ns > world.now_ns:
            self.leaving.append((left_ns, nbytes))
        self.coming.append((nbytes, arrive))
        world.at((self.last_ns - world.now_ns) * 1e-9, partial(self._arrive, self.number))

    def _arrive(self, number: int) -> None:
        if number != self.number:
            return
        _, arrive = self.coming.popleft()
        if self.link.cut or self.held:
            self.held.append(arrive)
        else:
            arrive()

    def send_on(self, world: VirtualWorld) -> None:
        """Send what is on its way over the link as it is now."""
        coming = tuple(self.coming)
        self._forget()
        for nbytes, arrive in coming:
            self.send(world, nbytes, arrive)

    def release(self) -> None:
        """Let arrive what a cut has held."""
        while self.held and not self.link.cut:
            self.held.popleft()()

    def break_off(self) -> None:
        """The connection is gone, and what was on its way with it."""
        self._forget()
        self.held.clear()

    def _forget(self) -> None:
        self.number += 1
        self.coming.clear()
        self.leaving.clear()
        self.free_ns = self.last_ns = 0
