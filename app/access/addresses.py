"""Addresses of clients: whom limits count as one client, and which are proxies that speak for others."""

from __future__ import annotations

import ipaddress
import socket
from functools import lru_cache
from typing import TYPE_CHECKING, Final, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Sequence

Address: TypeAlias = ipaddress.IPv4Address | ipaddress.IPv6Address
Network: TypeAlias = ipaddress.IPv4Network | ipaddress.IPv6Network
HOME_PREFIX: Final = 64  # bits of an IPv6 address that one customer of a network is given


@lru_cache(4096)
def parsed(host: str) -> Address | None:
    """An address, that of IPv4 where one of IPv6 stands for it; None for what is none, such as a socket's path."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return None
    return getattr(address, "ipv4_mapped", None) or address


@lru_cache(4096)
def client_of(host: str) -> str:
    """What is limited as one client: an IPv4 address, a /64 of IPv6, or a name that is no address."""
    address = parsed(host)
    if address is None or address.version == 4:
        return str(address or host)
    return str(ipaddress.ip_network((address, HOME_PREFIX), strict=False))


def networks(texts: Sequence[str]) -> tuple[Network, ...]:
    """Networks in the notation of CIDR, single addresses, or * for all; raises ValueError."""
    parts = [part for text in texts for part in (("0.0.0.0/0", "::/0") if text == "*" else (text,))]
    return tuple(ipaddress.ip_network(part, strict=False) for part in parts)


def is_within(host: str, among: Sequence[Network]) -> bool:
    """Whether a host is an address in one of the networks."""
    address = parsed(host)
    return address is not None and any(address in network for network in among)


def is_loopback(host: str) -> bool:
    """Whether who listens there is reached from this machine only; names are looked up."""
    address = parsed(host)
    if address is not None:
        return address.is_loopback
    try:
        found = {str(entry[4][0]) for entry in socket.getaddrinfo(host, None)} if host else set()
    except OSError:
        return False
    return bool(found) and all(is_loopback(each) for each in found if parsed(each) is not None)
