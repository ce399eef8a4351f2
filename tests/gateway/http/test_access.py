"""Roles, tokens and the lock-out."""

from __future__ import annotations

import pytest

from onemap_gateway.config import Role
from onemap_gateway.http.security import (
    FAILURE_WINDOW_S,
    LOCK_S,
    MAX_ADDRESSES,
    MAX_FAILURES,
    LockOut,
    TokenTable,
    client_network,
    required_role,
)


@pytest.mark.parametrize(
    ("request_line", "role"),
    [
        ("GET /", Role.NOBODY),
        ("GET /static/app.js", Role.NOBODY),
        ("GET /statics", Role.LOOK),
        ("GET /v1/map.png", Role.LOOK),
        ("OPTIONS /v1/map", Role.LOOK),
        ("POST /v1/queries", Role.LOOK),
        ("POST /mcp", Role.LOOK),
        ("POST /v1/searches", Role.SEARCH),
        ("DELETE /v1/searches/s1", Role.SEARCH),
        ("DELETE /v1/searches/", Role.ADMINISTER),
        ("PATCH /v1/searches/s1", Role.ADMINISTER),
        ("DELETE /v1/objects/s1", Role.ADMINISTER),
        ("POST /v1/new", Role.ADMINISTER),
    ],
)
def test_what_has_no_rule_needs_the_highest_role(request_line: str, role: Role) -> None:
    assert required_role(*request_line.split()) is role


def test_a_token_has_its_role_byte_for_byte() -> None:
    table = TokenTable({Role.ADMINISTER: "abc", Role.LOOK: "abcd", Role.SEARCH: ""})
    assert not table.open
    assert table.role(b"abc") is Role.ADMINISTER
    assert table.role(b"abcd") is Role.LOOK
    for wrong in (b"", b"ab", b"ABC", b"abc ", "äbc".encode()):
        assert table.role(wrong) is Role.NOBODY


def test_without_tokens_everybody_may_do_everything() -> None:
    assert TokenTable({Role.ADMINISTER: "", Role.LOOK: ""}).open


def test_failures_long_ago_lock_nobody_out() -> None:
    lock_out = LockOut()
    for index in range(3 * MAX_FAILURES):
        assert not lock_out.count("10.0.0.1", index * FAILURE_WINDOW_S / (MAX_FAILURES - 2))
    assert lock_out.locked_s("10.0.0.1", 0.0) == 0


def test_one_address_is_locked_out_for_a_while() -> None:
    lock_out = LockOut()
    assert [lock_out.count("10.0.0.1", 5.0) for _ in range(MAX_FAILURES)][-2:] == [False, True]
    assert lock_out.locked_s("10.0.0.1", 5.0) == LOCK_S
    assert lock_out.locked_s("10.0.0.2", 5.0) == 0
    assert lock_out.locked_s("10.0.0.1", 5.0 + LOCK_S) == 0


def test_the_addresses_remembered_are_bounded() -> None:
    lock_out = LockOut()
    for index in range(3 * MAX_ADDRESSES):
        lock_out.count(f"client{index}", 0.0)
    assert len(lock_out._failures) == MAX_ADDRESSES


@pytest.mark.parametrize(
    ("address", "network"),
    [
        ("192.168.1.7", "192.168.1.7"),
        ("::1", "::/64"),
        ("2001:db8:1:2:3::4", "2001:db8:1:2::/64"),
        ("::ffff:192.168.1.7", "192.168.1.7"),
        ("testclient", "testclient"),
    ],
)
def test_a_client_of_ipv6_is_its_network(address: str, network: str) -> None:
    assert client_network(address) == network
