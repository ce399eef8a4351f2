from __future__ import annotations

import numpy as np
import pytest

from onemap_tools.bench.transport.link_shape import BUFFER_S, LinkShape, PacketQueue


def queue(shape: LinkShape) -> PacketQueue:
    return PacketQueue(shape, np.random.default_rng(1))


def test_a_packet_takes_its_time_and_the_delay() -> None:
    link = queue(LinkShape(8e6, delay_s=0.02))
    link.offer(bytes(1000), 5.0)  # a millisecond at 8 Mbit/s
    assert link.next_s() == pytest.approx(5.021)
    assert link.arrived(5.02) == []
    assert link.arrived(5.0211) == [bytes(1000)]
    assert link.next_s() is None
    assert link.carried_bytes == 1000


def test_packets_wait_for_those_before_them_and_keep_their_order() -> None:
    link = queue(LinkShape(8e6))
    for number in range(3):
        link.offer(bytes([number]) * 1000, 1.0)
    assert link.arrived(1.0021) == [bytes([0]) * 1000, bytes([1]) * 1000]
    assert link.arrived(1.0031) == [bytes([2]) * 1000]


def test_no_more_arrives_than_the_rate_allows() -> None:
    link = queue(LinkShape(30e6))
    for number in range(20_000):  # 1 s at 240 Mbit/s
        link.offer(bytes(1500), 10.0 + number / 20_000)
    link.arrived(11.0)
    assert 8 * link.carried_bytes == pytest.approx(30e6, rel=0.01)
    assert link.dropped > 10_000


def test_a_full_buffer_drops_and_holds_no_more_than_its_time() -> None:
    link = queue(LinkShape(100e6))
    for _ in range(2000):
        link.offer(bytes(1500), 1.0)
    last = None
    while (at := link.next_s()) is not None:
        last = at
        link.arrived(at)
    assert last is not None
    assert last - 1.0 == pytest.approx(BUFFER_S, rel=0.01)


def test_the_share_that_is_lost_is_as_asked_for() -> None:
    link = queue(LinkShape(1e9, loss=0.01))
    for number in range(20_000):
        link.offer(b"x" * 100, float(number))
    assert link.dropped == pytest.approx(200, abs=50)


@pytest.mark.parametrize(
    ("numbers", "reason"),
    [((0.0,), "rate"), ((-1.0,), "rate"), ((1e6, -0.1), "delay"), ((1e6, 0.0, 1.0), "loss")],
)
def test_impossible_links_are_refused(numbers: tuple[float, ...], reason: str) -> None:
    with pytest.raises(ValueError, match=f"the link's {reason}"):
        LinkShape(*numbers)
