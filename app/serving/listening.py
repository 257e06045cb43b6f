"""The sockets that a service listens on, made once for all its processes."""

from __future__ import annotations

import socket
from contextlib import ExitStack


def bound_sockets(host: str, port: int) -> list[socket.socket]:
    """A socket for each address of a host, bound, not listening yet; port 0: any one, the same for all.

    Raises OSError naming the address.
    """
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    with ExitStack() as opened:
        bound: list[socket.socket] = []
        for family, kind, protocol, _, address in dict.fromkeys(found):
            listener = opened.enter_context(socket.socket(family, kind, protocol))
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            chosen = bound[0].getsockname()[1] if bound and port == 0 else port
            try:
                listener.bind((address[0], chosen, *address[2:]))
            except OSError as error:
                raise OSError(error.errno, f"can't listen on {address[0]} port {chosen}: {error.strerror}") from error
            bound.append(listener)
        opened.pop_all()
    return bound
