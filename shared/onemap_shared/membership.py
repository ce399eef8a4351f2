"""Which processes are on the bus, by their liveliness tokens, and whose role is taken."""
# Talks: Zenoh's liveliness tokens.

from __future__ import annotations

import time

import zenoh

from onemap_shared.keys import ALL_LIVELINESS, liveliness, member_of
from onemap_shared.services import role_of
from onemap_shared.transport import CALL_TIMEOUT_S


class Membership:
    """One process among the others. ``name``: its service and instance."""

    def __init__(
        self, session: zenoh.Session, settings: zenoh.Config, name: tuple[str, str]
    ) -> None:
        self.name = name
        self._settings = settings
        self._liveliness = session.liveliness()
        self._alive: dict[str, tuple[str, str]] = {}
        self._token: zenoh.LivelinessToken | None = None
        handler = zenoh.handlers.Callback(self._on_liveliness, indirect=False)
        self._subscriber = self._liveliness.declare_subscriber(
            ALL_LIVELINESS, handler, history=True
        )

    def _on_liveliness(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._alive[key] = member_of(key)
        else:
            self._alive.pop(key, None)

    def members(self) -> frozenset[tuple[str, str]]:
        """Service and instance of every process that is known to be connected."""
        return frozenset(self._alive.copy().values())

    def announce(self) -> None:
        """Show this process to the others, as long as it is connected."""
        if self._token is None:
            self._token = self._liveliness.declare_token(liveliness(*self.name))

    def claim(self) -> tuple[str, ...]:
        """Announce this process unless another has its role; empty if it did, else the others.

        Each announces itself and then asks, so that of two at the same time at least one finds the
        other and withdraws. If both do, both may try again. Raises ConnectionError without a
        router: then nobody can be asked.
        """
        others = self._others()
        if not others:
            self.announce()
            others = self._others()
        if others and self._token is not None:
            self._token.undeclare()  # type: ignore[no-untyped-call]
            self._token = None
        return others

    def _others(self) -> tuple[str, ...]:
        """The other processes that have the role of this one."""
        role = role_of(self.name[0])
        try:
            others = self.ask() - {self.name}
        except zenoh.ZError as problem:
            raise ConnectionError(f"the router does not answer: {problem}") from problem
        return tuple(sorted(" ".join(each) for each in others if role_of(each[0]) == role))

    def ask(self) -> frozenset[tuple[str, str]]:
        """Service and instance of every process on the bus, as the router knows now.

        Ours is one, if it was announced. ``members`` learns of them one by one and may know none
        yet right after joining. Asks in a session of its own: one that subscribes to the tokens is
        answered from its own cache. Of two processes that announce themselves and then ask, at
        least one finds the other.
        """
        deadline = time.monotonic() + CALL_TIMEOUT_S
        with zenoh.open(self._settings) as session:
            while True:
                replies = session.liveliness().get(ALL_LIVELINESS, timeout=CALL_TIMEOUT_S)
                found = frozenset(member_of(str(each.ok.key_expr)) for each in replies if each.ok)
                expected = self._token is None or self.name in found
                if expected or time.monotonic() > deadline:
                    return found
