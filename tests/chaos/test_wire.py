"""Mutated messages: every one is decoded or refused with a reason, none escapes."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace

import pytest

from onemap_shared.wire import Packet, WireError, decode, encode
from tests.chaos.report import Attack
from tests.shared import samples

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

MUTATIONS = 100_000
SEED = 11
EDGES = (0x00, 0x7F, 0x80, 0xC0, 0xC4, 0xCF, 0xD9, 0xDD, 0xDF, 0xFF)  # of msgpack's types


def mutated(data: bytes, rng: random.Random) -> bytes:
    """One to three random edits: a byte, a bit, a cut, a copied or an inserted piece."""
    changed = bytearray(data)
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(changed) + 1)
        kind = rng.randrange(6)
        if kind == 0 and at < len(changed):
            changed[at] = rng.randrange(256)
        elif kind == 1 and at < len(changed):
            changed[at] ^= 1 << rng.randrange(8)
        elif kind == 2 and at < len(changed):
            changed[at] = rng.choice(EDGES)
        elif kind == 3:
            del changed[at : at + rng.randint(1, 64)]
        elif kind == 4:
            changed[at:at] = changed[:at][-rng.randint(1, 64) :]
        else:
            changed[at:at] = rng.randbytes(rng.randint(1, 16))
    return bytes(changed)


def test_mutated_messages(attack: Attack) -> None:
    rng, count = random.Random(SEED), attack.attempts(MUTATIONS)
    messages = samples.SAMPLES
    packets = [(type(message), encode(message)) for message in messages]
    outcomes: Counter[str] = Counter()
    for number in range(count):
        message, packet = packets[number % len(packets)]
        part = "header" if rng.random() < 0.8 or not packet.body else "body"
        broken: Packet = replace(packet, **{part: mutated(getattr(packet, part), rng)})
        try:
            decode(message, broken)
            outcomes["decoded"] += 1
        except WireError:
            outcomes["refused"] += 1
        except Exception as problem:
            outcomes[f"{message.__name__}: {type(problem).__name__}"] += 1
    escaped = {name: n for name, n in outcomes.items() if name not in ("decoded", "refused")}
    attack.holds(
        f"{count:,} mutated messages of {len(packets)} types",
        limit="0 escape as another error",
        measured=f"{outcomes['refused']} refused, {outcomes['decoded']} decoded, "
        f"{sum(escaped.values())} escaped {escaped or ''}".strip(),
        held=not escaped,
    )
