"""What the sources and ``docs/messages.md`` say of messages is complete and true."""

from __future__ import annotations

import dataclasses
import inspect
import re
from typing import Any

import numpy as np
import pytest

from onemap_shared import messages as m
from onemap_shared import wire
from tests.shared.samples import PARTS, SAMPLES, equal, message_types
from tests.structure import ROOT

PAGE = (ROOT / "docs" / "messages.md").read_text(encoding="utf-8")
SHAPE = re.compile(r"\(([^)]*)\) ")  # that the description of an array begins with


def described(cls: Any) -> dict[str, str]:
    """What "Attributes:" of a docstring says of each field."""
    section = inspect.cleandoc(cls.__doc__ or "").partition("Attributes:")[2]
    entries = re.findall(r"^ {4}(\w+): (.*(?:\n {5,}.*)*)", section, re.MULTILINE)
    return {name: " ".join(text.split()) for name, text in entries}


COMMON = described(m)


@pytest.mark.parametrize("cls", sorted({*message_types(), *PARTS}, key=str))
def test_every_field_is_described(cls: Any) -> None:
    fields = (
        {field.name for field in dataclasses.fields(cls)} if dataclasses.is_dataclass(cls) else {}
    )
    assert set(fields) - described(cls).keys() <= COMMON.keys()
    assert described(cls).keys() <= set(fields)


def test_shapes_are_those_of_messages() -> None:
    """As many axes as the samples have; where a length is a number, that length."""
    for sample in SAMPLES:
        told = COMMON | described(type(sample))
        for field in dataclasses.fields(sample):
            value = getattr(sample, field.name)
            if isinstance(value, np.ndarray):
                shape = SHAPE.match(told[field.name])
                assert shape is not None, (type(sample), field.name)
                lengths = [part.strip() for part in shape[1].split(",") if part.strip()]
                fixed = zip(lengths, value.shape, strict=True)
                assert all(int(want) == have for want, have in fixed if want.isdigit())


def test_the_example_is_a_packet() -> None:
    header, body = (bytes.fromhex(part) for part in re.findall(r"^([0-9a-f]{90,})$", PAGE, re.M))
    pose = np.array([[1.0, 0, 0, 1.5], [0, 1, 0, -2], [0, 0, 1, 0], [0, 0, 0, 1]])
    told = m.Odometry(41, 1_700_000_000_000_000_000, pose, 0.5, -0.25)
    assert equal(wire.decode(m.Odometry, wire.Packet(header, body)), told)


def test_the_page_of_the_wire_has_the_limits_of_the_code() -> None:
    assert f"`onemap.Odometry/{wire.VERSION}`" in PAGE
    assert f"multiple of {wire.ALIGNMENT} bytes" in PAGE
    limits = wire.MAX_DIMENSIONS, wire.MAX_HEADER_BYTES, wire.MAX_BODY_BYTES
    assert "{} axes, {} bytes of header, {} bytes of body".format(*limits) in PAGE
    assert all(f"`{name}` {dtype.name}" in PAGE for name, dtype in wire.DTYPES.items())
