from __future__ import annotations

import dataclasses
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared import messages as m
from onemap_shared import wire
from onemap_shared.wire import MAX_REASON_CHARS, Packet, WireError, decode, encode
from tests.shared.samples import SAMPLES, equal, message_types

FRAME = next(sample for sample in SAMPLES if isinstance(sample, m.RgbdFrame))


def test_there_is_a_sample_of_every_message() -> None:
    assert {type(sample) for sample in SAMPLES} == message_types()


@pytest.mark.parametrize("message", SAMPLES, ids=lambda sample: type(sample).__name__)
def test_messages_survive_the_wire(message: Any) -> None:
    received = decode(type(message), encode(message))
    assert equal(message, received)


def test_received_arrays_are_read_only() -> None:
    received = decode(m.RgbdFrame, encode(FRAME))
    with pytest.raises(ValueError, match="read-only"):
        received.rgb[0, 0, 0] = 1


def test_arrays_that_are_not_contiguous_or_little_endian_travel_all_the_same() -> None:
    odd = dataclasses.replace(FRAME, rgb=np.asfortranarray(FRAME.rgb)[::-1])
    big = dataclasses.replace(odd, T_map_camera=odd.T_map_camera.astype(">f8"))
    received = decode(m.RgbdFrame, encode(big))
    np.testing.assert_array_equal(received.rgb, odd.rgb)
    np.testing.assert_array_equal(received.T_map_camera, odd.T_map_camera)


def tamper(message: Any, **changes: Any) -> Packet:
    """The packet with header entries replaced: values_*, arrays_* or top level."""
    packet = encode(message)
    header = msgpack.unpackb(packet.header)
    for path, value in changes.items():
        place, _, name = path.partition("_")
        if place in ("values", "arrays"):
            header[place][name] = value
        else:
            header[path] = value
    return Packet(msgpack.packb(header), packet.body)


def test_an_array_with_a_default_may_be_missing_and_one_that_is_not_known_is_left_out() -> None:
    field = next(sample for sample in SAMPLES if isinstance(sample, m.FeatureField))
    packet = tamper(field, arrays_later=["|u1", [1], 0])
    header = msgpack.unpackb(packet.header)
    del header["arrays"]["colours"]
    older = decode(m.FeatureField, Packet(msgpack.packb(header), packet.body))
    assert equal(older, dataclasses.replace(field, colours=np.zeros((0, 0, 3), np.uint8)))


FIND = next(sample for sample in SAMPLES if isinstance(sample, m.ObjectFind))
BAD_FINDS = {
    "bytes of another type": (tamper(FIND, arrays_picture=["<i4", [1], 0]), "expected uint8"),
    "bytes of two axes": (tamper(FIND, arrays_picture=["|u1", [2, 2], 0]), "expected uint8"),
    "bytes beyond the body": (tamper(FIND, arrays_picture=["|u1", [99], 0]), "needs bytes"),
    "no bytes": (tamper(FIND, arrays_picture=None), "missing or not described"),
}


@pytest.mark.parametrize("name", BAD_FINDS)
def test_bad_bytes_are_refused_with_the_reason(name: str) -> None:
    packet, reason = BAD_FINDS[name]
    with pytest.raises(WireError, match=reason):
        decode(m.ObjectFind, packet)


BAD_PACKETS = {
    "empty": (Packet(b"", b""), "not msgpack"),
    "garbage header": (Packet(b"\xc1" * 30, b""), "not msgpack"),
    "header is a list": (Packet(msgpack.packb([1]), b""), "lacks schema"),
    "truncated body": (Packet(encode(FRAME).header, encode(FRAME).body[:50]), "needs bytes"),
    "truncated header": (Packet(encode(FRAME).header[:-9], encode(FRAME).body), "not msgpack"),
    "oversized header": (Packet(b"x" * (wire.MAX_HEADER_BYTES + 1), b""), "limit"),
    "oversized body": (Packet(encode(FRAME).header, bytes(wire.MAX_BODY_BYTES + 1)), "limit"),
    "other version": (tamper(FRAME, schema="onemap.RgbdFrame/2"), "this version reads"),
    "other message": (tamper(FRAME, schema="onemap.Odometry/1"), "this version reads"),
    "object dtype": (tamper(FRAME, arrays_rgb=["|O", [6, 8, 3], 0]), "allowed are"),
    "wrong dtype": (tamper(FRAME, arrays_rgb=["<f4", [2, 3, 3], 0]), "expected uint8"),
    "negative length": (tamper(FRAME, arrays_rgb=["|u1", [-6, 8, 3], 0]), "lengths >= 0"),
    "fractional length": (tamper(FRAME, arrays_rgb=["|u1", [6.0, 8, 3], 0]), "lengths >= 0"),
    "many dimensions": (tamper(FRAME, arrays_rgb=["|u1", [1] * 9, 0]), "lengths >= 0"),
    "huge length": (tamper(FRAME, arrays_rgb=["|u1", [2**40, 2**40, 3], 0]), "needs bytes"),
    "negative offset": (tamper(FRAME, arrays_rgb=["|u1", [6, 8, 3], -8]), "needs bytes"),
    "no such description": (tamper(FRAME, arrays_rgb="all of it"), "not described"),
    "text for a number": (tamper(FRAME, values_sequence="7"), "expected"),
    "bool for a number": (tamper(FRAME, values_sequence=True), "expected"),
    "number beyond 63 bits": (tamper(FRAME, values_stamp_ns=2**63), "the largest number"),
    "missing value": (tamper(FRAME, values_sequence=None), r"field sequence \(int\) is missing"),
    "broken nested value": (tamper(FRAME, values_intrinsics={"fx": 1.0}), r"intrinsics\.fy"),
}


@pytest.mark.parametrize("case", BAD_PACKETS)
def test_bad_packets_are_refused_with_the_reason(case: str) -> None:
    packet, reason = BAD_PACKETS[case]
    with pytest.raises(WireError, match=reason):
        decode(m.RgbdFrame, packet)


OLDER_COMMAND = m.VelocityCommand(3, 5, 0.2, -0.4)


def older(message: Any, *names: str) -> Packet:
    """The packet of a sender that does not know these fields."""
    header = msgpack.unpackb(encode(message).header)
    for name in names:
        del header["values"][name]
    return Packet(msgpack.packb(header), encode(message).body)


def test_what_has_a_default_may_be_left_out() -> None:
    packet = older(OLDER_COMMAND, "planner", "odometry_stamp_ns", "validity_ms")
    assert decode(m.VelocityCommand, packet) == OLDER_COMMAND
    with pytest.raises(WireError, match="linear_mps"):
        decode(m.VelocityCommand, older(OLDER_COMMAND, "linear_mps"))
    with pytest.raises(WireError, match="planner"):
        decode(m.VelocityCommand, tamper(OLDER_COMMAND, values_planner=None))


def test_what_has_a_default_in_a_part_of_a_message_may_be_left_out() -> None:
    listed = next(sample for sample in SAMPLES if isinstance(sample, m.ObjectList))
    header = msgpack.unpackb(encode(listed).header)
    del header["values"]["objects"][0]["height_m"]
    packet = Packet(msgpack.packb(header), b"")
    (kept,) = decode(m.ObjectList, packet).objects
    assert kept == dataclasses.replace(listed.objects[0], height_m=())
    del header["values"]["objects"][0]["score"]
    with pytest.raises(WireError, match=r"objects.score .* missing"):
        decode(m.ObjectList, Packet(msgpack.packb(header), b""))


def test_an_unknown_state_is_refused() -> None:
    status = next(sample for sample in SAMPLES if isinstance(sample, m.SearchStatus))
    with pytest.raises(WireError, match="dreaming"):
        decode(m.SearchStatus, tamper(status, values_state="dreaming"))


@given(st.dictionaries(st.text(max_size=20), st.floats(allow_nan=False), max_size=5), st.text())
def test_heartbeats_of_any_content_survive(metrics: dict[str, float], problem: str) -> None:
    beat = m.Heartbeat("mapper", "a", 1, 2, ready=False, problem=problem, metrics=metrics)
    try:
        packet = encode(beat)
    except UnicodeEncodeError:  # lone surrogates are not text
        return
    assert decode(m.Heartbeat, packet) == beat


def test_a_reason_quotes_little_of_the_packet() -> None:
    header = {"schema": "x" * 200_000, "values": {}, "arrays": {}}
    with pytest.raises(WireError) as refusal:
        decode(m.Heartbeat, Packet(msgpack.packb(header), b""))
    assert len(str(refusal.value)) == MAX_REASON_CHARS
