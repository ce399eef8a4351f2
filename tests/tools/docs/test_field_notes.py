"""Fields are described in the "Attributes" section of a docstring."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from onemap_tools.docs.field_notes import field_notes, parse, split_shape


@dataclass
class Box:
    """A box.

    Closed.

    Attributes:
        size_m: edge of it,
            in metres.
        weight_kg: 0: empty.
    """

    size_m: float
    weight_kg: float
    stamp_ns: int


def test_text_and_fields_are_told_apart() -> None:
    parts = parse(Box.__doc__ or "")
    assert parts.text == "A box.\n\nClosed."
    assert parts.fields == {"size_m": "edge of it, in metres.", "weight_kg": "0: empty."}


def test_a_docstring_without_attributes_is_text() -> None:
    assert parse("A box.") == parse("A box.\n")
    assert parse("A box.").fields == {}


def test_common_fields_are_described_once_in_the_order_of_the_class() -> None:
    notes = field_notes(Box, {"stamp_ns": "a time.", "size_m": "not used.", "other": "nor this."})
    assert list(notes.items()) == [
        ("size_m", "edge of it, in metres."),
        ("weight_kg", "0: empty."),
        ("stamp_ns", "a time."),
    ]


def test_a_field_that_is_described_nowhere_is_an_error() -> None:
    with pytest.raises(ValueError, match=r"Box: .* differ in stamp_ns"):
        field_notes(Box, {})


def test_a_description_of_no_field_is_an_error() -> None:
    @dataclass
    class Bag:
        """A bag.

        Attributes:
            size_m: which it does not have.
        """

    with pytest.raises(ValueError, match=r"Bag: .* differ in size_m"):
        field_notes(Bag, {})


def test_an_array_begins_with_its_shape() -> None:
    assert split_shape("(N, 4) boxes (in pixels).") == ("(N, 4)", "boxes (in pixels).")
    with pytest.raises(ValueError, match="begins with its shape, not with 'boxes'"):
        split_shape("boxes")
