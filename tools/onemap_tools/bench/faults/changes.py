"""What becomes of the messages of a topic: doubled, out of order, late, damaged, false."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

from onemap_shared.messages import Odometry
from onemap_shared.wire import Packet, WireError, decode, encode

Change = Callable[[Packet], list[Packet]]
NAN = b"\x00\x00\xc0\x7f" * 2  # as float16, float32 or float64
JUMP_M = (0.1, 3.0)
QUEUED = (2, 30)  # messages; 20 commands come in a second


def doubled(_rng: random.Random) -> Change:
    """Every message comes twice."""
    return lambda packet: [packet, packet]


def silent(_rng: random.Random) -> Change:
    """None comes, though its publisher lives."""
    return lambda _packet: []


def disordered(_rng: random.Random) -> Change:
    """Every other message comes after the one that follows it."""
    held: list[Packet] = []

    def change(packet: Packet) -> list[Packet]:
        if held:
            return [packet, held.pop()]
        held.append(packet)
        return []

    return change


def queued(rng: random.Random) -> Change:
    """They wait in a queue, as those of a driver that obeys one after the other."""
    held: list[Packet] = []
    length = rng.randint(*QUEUED)

    def change(packet: Packet) -> list[Packet]:
        held.append(packet)
        return [held.pop(0)] if len(held) > length else []

    return change


def frozen(_rng: random.Random) -> Change:
    """The first message comes again and again."""
    first: list[Packet] = []

    def change(packet: Packet) -> list[Packet]:
        first.append(packet)
        return first[:1]

    return change


def damaged(rng: random.Random) -> Change:
    """In the arrays of every message a byte is another one."""
    return lambda packet: [Packet(packet.header, _other_byte(packet.body, rng))]


def garbled(rng: random.Random) -> Change:
    """In the header of every message a byte is another one: a name, a stamp, a shape."""
    return lambda packet: [Packet(_other_byte(packet.header, rng), packet.body)]


def not_finite(rng: random.Random) -> Change:
    """In the arrays of every message are numbers that are none."""

    def change(packet: Packet) -> list[Packet]:
        body = bytearray(packet.body)
        if len(body) >= len(NAN):
            at = rng.randrange(len(body) // len(NAN)) * len(NAN)
            body[at : at + len(NAN)] = NAN
        return [Packet(packet.header, bytes(body))]

    return change


def jumping(rng: random.Random) -> Change:
    """Odometry is off by some way, the same all the time."""
    off_m = rng.uniform(*JUMP_M)

    def false(odometry: Odometry) -> Odometry:
        T_map_body = odometry.T_map_body.copy()
        T_map_body[0, 3] += off_m
        return replace(odometry, T_map_body=T_map_body)

    return _of_odometry(false)


def lying(_rng: random.Random) -> Change:
    """Odometry says that the robot stands."""
    return _of_odometry(lambda odometry: replace(odometry, linear_mps=0.0, angular_radps=0.0))


def _of_odometry(false: Callable[[Odometry], Odometry]) -> Change:
    def change(packet: Packet) -> list[Packet]:
        try:
            return [encode(false(decode(Odometry, packet)))]
        except WireError:  # damaged before
            return [packet]

    return change


def _other_byte(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    if changed:
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed)


CHANGES: dict[str, Callable[[random.Random], Change]] = {
    each.__name__.replace("_", " "): each
    for each in (
        doubled, silent, disordered, queued, frozen, damaged, garbled, not_finite, jumping, lying,
    )
}  # fmt: skip
