"""What is written from the code is complete: messages, their example and fields."""

from __future__ import annotations

import dataclasses
import re

import numpy as np

from onemap_shared import keys, wire
from onemap_shared.keys import Procedure, Topic
from onemap_tools import message_reference as reference
from onemap_tools.message_reference import EXAMPLE, messages_reference
from tests.shared.samples import SAMPLES, equal
from tests.shared.samples import message_types as all_message_types
from tests.structure import ROOT

MESSAGES = messages_reference()


def section(cls: type) -> str:
    return MESSAGES.split(f"\n### {cls.__name__}\n")[1].split("\n##")[0]


def test_every_key_and_every_message_is_listed_once() -> None:
    assert set(reference.message_types()) == all_message_types()
    fixed = [v for v in vars(keys).values() if isinstance(v, Topic | Procedure)]
    assert len(fixed) > 15
    for entry in fixed:
        assert f"| `{entry.key.replace('*', '<service>')}` |" in MESSAGES
    headings = re.findall(r"^### (\w+)$", MESSAGES, re.MULTILINE)
    assert len(headings) == len(set(headings))
    assert {"Intrinsics", "GridSpec", "ObjectResult", "Verdict", "Layer"} <= set(headings)


def test_shapes_are_those_of_messages() -> None:
    """As many axes as the samples have; where a length is a number, that length."""
    for sample in SAMPLES:
        for field in dataclasses.fields(sample):
            value = getattr(sample, field.name)
            if not isinstance(value, np.ndarray):
                continue
            row = re.search(
                rf"\| `{field.name}` \| array of (\w+) \| \(([^)]+)\)", section(type(sample))
            )
            assert row is not None, (type(sample), field.name)
            assert row[1] == value.dtype.name
            lengths = [part.strip() for part in row[2].split(",") if part.strip()]
            fixed = zip(lengths, value.shape, strict=True)
            assert all(int(want) == have for want, have in fixed if want.isdigit())


def test_the_example_is_a_packet() -> None:
    header, body = (
        bytes.fromhex("".join(line[6:53] for line in dump.strip().splitlines()))
        for dump in re.findall(r"```text\n(.*?)```", MESSAGES, re.DOTALL)
    )
    assert equal(wire.decode(type(EXAMPLE), wire.Packet(header, body)), EXAMPLE)


def test_the_page_of_the_wire_has_the_limits_of_the_code() -> None:
    page = (ROOT / "docs" / "messages.md").read_text(encoding="utf-8")
    assert f"`onemap.Odometry/{wire.VERSION}`" in page
    assert f"multiple of {wire.ALIGNMENT} bytes" in page
    limits = wire.MAX_DIMENSIONS, wire.MAX_HEADER_BYTES, wire.MAX_BODY_BYTES
    assert "{} axes, {} bytes of header, {} bytes of body".format(*limits) in page
    assert all(f"`{name}` {dtype.name}" in page for name, dtype in wire.DTYPES.items())
