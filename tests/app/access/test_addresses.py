"""Whom limits count as one client."""

from __future__ import annotations

import pytest

from app.access.addresses import client_of, is_loopback, is_within, networks


@pytest.mark.parametrize(
    ("host", "client"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("::ffff:192.0.2.7", "192.0.2.7"),  # IPv4 through a socket of both families
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("/run/joulepath.sock", "/run/joulepath.sock"),
    ],
)
def test_client_is_an_address_or_the_network_that_one_customer_has(host: str, client: str) -> None:
    assert client_of(host) == client


@pytest.mark.parametrize(
    ("host", "local"),
    [
        ("127.0.0.1", True),
        ("127.8.0.1", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("::", False),
        ("", False),
        ("192.0.2.7", False),
        ("no-such-name.invalid", False),
    ],
)
def test_only_this_machines_own_addresses_are_loopback(host: str, local: bool) -> None:
    assert is_loopback(host) is local


def test_proxies_are_named_by_address_network_or_star() -> None:
    among = networks(["10.0.0.0/8", "2001:db8::7"])
    assert is_within("10.255.0.1", among)
    assert is_within("::ffff:10.0.0.1", among)
    assert is_within("2001:db8::7", among)
    assert not is_within("11.0.0.1", among)
    assert not is_within("a socket", among)
    assert is_within("203.0.113.5", networks(["*"]))
    assert is_within("2001:db8::9", networks(["*"]))
