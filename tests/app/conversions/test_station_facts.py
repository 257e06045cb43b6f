"""A station's sockets, price and source are the same in every answer."""

from __future__ import annotations

import pytest

from app.conversions.stations.facts import price_fields, socket_fields, source_fields
from app.schemas.charging import ChargingPlanAnswer, ChargingStopAnswer, StopStation
from app.schemas.stations.facts import PriceAnswer, SocketAnswer, StationSourceAnswer
from app.stations.answer import StationCollection, StationProperties
from energy.charging.charging import Connector
from routing.stations.station import Price, Socket, StationSource


@pytest.mark.parametrize("output_w", [None, 22_000.0, 22_166.666_666_67, 43.7e3])
def test_sockets_have_the_fields_of_their_schema_and_no_other(output_w: float | None) -> None:
    fields = socket_fields(Socket(Connector.TYPE2, output_w, 2, 3))
    answer = SocketAnswer.model_validate(fields)
    assert list(fields) == list(SocketAnswer.model_fields)
    assert answer.output_kw == (None if output_w is None else pytest.approx(output_w / 1000.0, abs=1e-9))
    assert (answer.connector, answer.count, answer.phases) == (Connector.TYPE2, 2, 3)


def test_prices_and_sources_have_the_fields_of_their_schema_and_no_other() -> None:
    price = price_fields(Price("0.5 EUR/kWh", "EUR", 0.5))
    source = source_fields(StationSource("x", "a register", "CC0-1.0", "https://example.org", "2026-11-30"))
    assert price is not None
    assert list(price) == list(PriceAnswer.model_fields)
    assert PriceAnswer.model_validate(price).per_kwh == 0.5
    assert list(source) == list(StationSourceAnswer.model_fields)
    assert StationSourceAnswer.model_validate(source).licence == "CC0-1.0"
    assert price_fields(None) is None


def test_plans_and_lists_of_stations_share_their_schemas() -> None:
    for schema in (StopStation, StationProperties):
        assert schema.model_fields["sockets"].annotation == list[SocketAnswer]
        assert schema.model_fields["price"].annotation == PriceAnswer | None
    assert ChargingStopAnswer.model_fields["socket"].annotation == SocketAnswer | None
    for sources in (ChargingPlanAnswer, StationCollection):
        assert sources.model_fields["sources"].annotation == list[StationSourceAnswer]
