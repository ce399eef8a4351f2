"""The page of messages is complete, and its example is a packet."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from onemap_shared import keys, wire
from onemap_shared.keys import Procedure, Topic
from onemap_tools.docs.messages_page import EXAMPLE, hex_dump, message_types, messages_page
from tests.shared.samples import SAMPLES, equal
from tests.shared.samples import message_types as all_message_types

PAGE = messages_page()


def test_every_message_is_listed() -> None:
    assert set(message_types()) == all_message_types()


@pytest.mark.parametrize("cls", [*message_types()], ids=lambda cls: cls.__name__)
def test_every_field_has_a_type_and_a_meaning(cls: type) -> None:
    section = PAGE.split(f"\n### {cls.__name__}\n")[1].split("\n##")[0]
    for field in dataclasses.fields(cls):
        assert re.search(rf"\| `{field.name}` \| [^|]+ \| [^|]*\| [^|]+ \|", section), field.name


def test_no_type_is_described_twice() -> None:
    headings = re.findall(r"^### (\w+)$", PAGE, re.MULTILINE)
    assert len(headings) == len(set(headings))
    assert {"Intrinsics", "GridSpec", "ObjectResult"} <= set(headings)


def test_every_key_is_listed() -> None:
    fixed = [v for v in vars(keys).values() if isinstance(v, Topic | Procedure)]
    assert len(fixed) > 15
    for entry in fixed:
        assert f"| `{entry.key.replace('*', '<service>')}` |" in PAGE


def test_latched_topics_and_impatient_procedures_are_marked() -> None:
    assert "| `map/revision/v1` | [MapRevision](#maprevision) | state | yes |" in PAGE
    assert "| `robot/rgbd/v1` | [RgbdFrame](#rgbdframe) | frame | no |" in PAGE
    assert "[SearchStatus](#searchstatus) | 0.5 s |" in PAGE


def test_the_example_is_a_packet() -> None:
    header, body = (
        bytes.fromhex("".join(line[6:53] for line in dump.strip().splitlines()))
        for dump in re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
    )
    assert equal(wire.decode(type(EXAMPLE), wire.Packet(header, body)), EXAMPLE)


def test_shapes_on_the_page_are_those_of_messages() -> None:
    """As many axes as the samples have; where a length is a number, that length."""
    for sample in SAMPLES:
        section = PAGE.split(f"\n### {type(sample).__name__}\n")[1].split("\n##")[0]
        for field in dataclasses.fields(sample):
            value = getattr(sample, field.name)
            if isinstance(value, np.ndarray):
                row = re.search(rf"\| `{field.name}` \| array of (\w+) \| \(([^)]+)\)", section)
                assert row is not None, (type(sample), field.name)
                assert row[1] == value.dtype.name
                lengths = [part.strip() for part in row[2].split(",") if part.strip()]
                assert len(lengths) == value.ndim
                fixed = [(int(n), have) for n, have in zip(lengths, value.shape, strict=True)
                         if n.isdigit()]  # fmt: skip
                assert all(want == have for want, have in fixed), (type(sample), field.name)


def test_a_dump_shows_offset_bytes_and_text() -> None:
    lines = list(hex_dump(bytes(range(60, 80))))
    assert lines[0].startswith("0000  3c 3d 3e ")
    assert lines[0].endswith("  <=>?@ABCDEFGHIJK")
    assert lines[1] == "0010  4c 4d 4e 4f" + " " * 38 + "LMNO"
