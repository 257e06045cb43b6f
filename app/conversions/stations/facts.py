"""Facts of a charging station as answers have them: sockets, price, source."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from routing.stations.station import Price, Socket, StationSource

W_PER_KW: Final = 1000.0
DIGITS: Final = 9  # of kW, so that a number comes back as it was sent


def socket_fields(socket: Socket) -> dict[str, Any]:
    """The fields of a SocketAnswer in their order."""
    return {
        "connector": socket.connector.value,
        "output_kw": None if socket.output_w is None else kilowatts(socket.output_w),
        "count": socket.count,
        "phases": socket.phases,
    }


def price_fields(price: Price | None) -> dict[str, Any] | None:
    """The fields of a PriceAnswer in their order, None without a price."""
    if price is None:
        return None
    return {
        "text": price.text,
        "currency": price.currency,
        "per_kwh": price.per_kwh,
        "per_min": price.per_min,
        "per_session": price.per_session,
    }


def source_fields(source: StationSource) -> dict[str, Any]:
    """The fields of a StationSourceAnswer in their order."""
    return {
        "key": source.key,
        "name": source.name,
        "licence": source.licence,
        "url": source.url,
        "retrieved": source.retrieved,
    }


def kilowatts(power_w: float) -> float:
    """A power [W] in kilowatts."""
    return round(power_w / W_PER_KW, DIGITS)
