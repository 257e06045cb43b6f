"""Routes as GPX, KML, GeoParquet and CSV, read by other programs."""

from __future__ import annotations

import csv
import io
from datetime import datetime
from typing import TYPE_CHECKING, Any

import geopandas
import numpy as np
import pyogrio
import pytest

from app.exports.xml import clean
from app.schemas.lean.formats import AnswerFormat
from app.schemas.place import LineString
from app.schemas.route import RouteRequest
from app.service.service import Service
from tests.app.charged import ROUTE as CHARGED
from tests.app.charged import charged_settings
from tests.app.exports.expected_gpx import checked_gpx, texts

if TYPE_CHECKING:
    from pathlib import Path

TRIP: dict[str, Any] = {"start": [8.001, 46.5], "via": [[8.02, 46.505]], "goal": [8.0, 46.515], "soc": 0.5}


def asked(service: Service, form: AnswerFormat, **changes: Any) -> bytes:
    return service.route_in(form, RouteRequest.model_validate(TRIP | changes))


def test_gpx_keeps_to_its_schema_and_has_the_line_with_heights_and_times(service: Service) -> None:
    changes = {"conditions": {"departure": "2026-12-01T08:00:00"}, "alternatives": ["eco", "fastest"]}
    root = checked_gpx(asked(service, AnswerFormat.GPX, **changes))
    sent = RouteRequest.model_validate(TRIP | changes)
    routes = service.route(sent).routes
    assert texts(root, "trk/name") == ["eco", "fastest"]
    assert texts(root, "wpt/type") == ["start", "via", "goal"]
    assert not texts(root, "rte/name")
    track = root.findall("{*}trk")[0]
    points = track.findall("{*}trkseg/{*}trkpt")
    assert [(float(p.attrib["lon"]), float(p.attrib["lat"])) for p in points] == routes[0].geometry.coordinates
    times = [datetime.fromisoformat(time.text or "") for time in track.findall("{*}trkseg/{*}trkpt/{*}time")]
    assert times[0] == datetime(2026, 12, 1, 8)
    assert (times[-1] - times[0]).total_seconds() == pytest.approx(routes[0].duration_s, abs=0.5)
    assert times == sorted(times)
    heights = [float(height.text or "") for height in track.findall("{*}trkseg/{*}trkpt/{*}ele")]
    for link in routes[0].links or []:
        assert heights[link.geometry_end] == pytest.approx(link.height_end_m, abs=0.051)


def test_gpx_without_departure_begins_now_in_universal_time_and_without_terrain_has_no_heights(
    service: Service,
) -> None:
    root = checked_gpx(asked(service, AnswerFormat.GPX, graph="level"))
    assert texts(root, "trk/trkseg/trkpt/time")[0].endswith("Z")
    assert not texts(root, "trk/trkseg/trkpt/ele")


def test_gpx_has_steps_as_a_route_where_they_are_asked_for(service: Service) -> None:
    root = checked_gpx(asked(service, AnswerFormat.GPX, steps=True))
    answer = service.route(RouteRequest.model_validate(TRIP | {"steps": True}))
    steps = answer.routes[0].steps
    assert steps is not None
    assert texts(root, "rte/rtept/name") == [step.instruction for step in steps]


def test_time_passes_at_charging_stops(tmp_path: Path) -> None:
    service = Service(charged_settings(tmp_path))
    sent = RouteRequest.model_validate(CHARGED)
    (route,) = service.route(sent).routes
    assert route.charging is not None
    root = checked_gpx(service.route_in(AnswerFormat.GPX, sent))
    times = [datetime.fromisoformat(time) for time in texts(root, "trk/trkseg/trkpt/time")]
    stops = route.charging.stops
    assert len(stops) > 0
    assert isinstance(route.geometry, LineString)
    assert len(times) == len(route.geometry.coordinates) + len(stops)
    assert (times[-1] - times[0]).total_seconds() == pytest.approx(route.total_s, abs=0.5)
    since_s = [(time - times[0]).total_seconds() for time in times]
    for stop in stops:
        arrived = min(range(len(since_s)), key=lambda k: abs(since_s[k] - stop.arrive_s))
        assert since_s[arrived] == pytest.approx(stop.arrive_s, abs=0.5)
        assert since_s[arrived + 1] == pytest.approx(stop.depart_s, abs=0.5)
    assert texts(root, "wpt/type").count("charging stop") == len(stops)


@pytest.mark.parametrize(
    ("form", "layer", "count"),
    [(AnswerFormat.GPX, "tracks", 1), (AnswerFormat.GPX, "waypoints", 3), (AnswerFormat.KML, None, 4)],
)
def test_gdal_reads_lines_and_places(
    service: Service, tmp_path: Path, form: AnswerFormat, layer: str | None, count: int
) -> None:
    path = tmp_path / f"route.{form}"
    path.write_bytes(asked(service, form))
    frame = pyogrio.read_dataframe(path, **({} if layer is None else {"layer": layer}))
    assert len(frame) == count
    assert frame.crs.to_epsg() == 4326
    if form is AnswerFormat.KML:
        (route,) = service.route(RouteRequest.model_validate(TRIP)).routes
        assert float(frame.iloc[0]["energy_kwh"]) == pytest.approx(route.energy_kwh, rel=1e-5)
        assert next(iter(frame.iloc[0].geometry.coords))[:2] == route.geometry.coordinates[0]


def test_geoparquet_has_a_row_for_each_link_with_its_line(service: Service) -> None:
    frame = geopandas.read_parquet(io.BytesIO(asked(service, AnswerFormat.PARQUET)))
    (route,) = service.route(RouteRequest.model_validate(TRIP)).routes
    assert frame["id"].tolist() == [link.id for link in route.links or []]
    assert frame["energy_wh"].sum() == pytest.approx(route.energy_kwh * 1000.0)
    parts = [name for name in frame.columns if name.startswith("energy_parts_wh.")]
    assert np.allclose(frame[parts].sum(axis=1), frame["energy_wh"])
    places = [place for line in frame.geometry for place in list(line.coords)]
    assert list(dict.fromkeys(places)) == list(dict.fromkeys(route.geometry.coordinates))


def test_geoparquet_without_links_has_a_row_for_each_route(service: Service) -> None:
    body = asked(service, AnswerFormat.PARQUET, links=False, alternatives=["eco", "fastest"])
    frame = geopandas.read_parquet(io.BytesIO(body))
    assert frame["route"].tolist() == ["eco", "fastest"]
    assert (frame.geometry.geom_type == "LineString").all()


def test_csv_has_a_line_for_each_link_and_the_columns_that_are_asked_for(service: Service) -> None:
    whole = list(csv.DictReader(io.StringIO(asked(service, AnswerFormat.CSV).decode())))
    (route,) = service.route(RouteRequest.model_validate(TRIP)).routes
    assert [float(row["soc_end"]) for row in whole] == [link.soc_end for link in route.links or []]
    assert {row["rest"] for row in whole} == {"true", "false"}
    names = ["routes.links.id", "routes.links.energy_parts_wh.rolling"]
    few = asked(service, AnswerFormat.CSV, fields=names, compact=True).decode().splitlines()
    assert few[0] == "route,id,energy_parts_wh.rolling"
    rolling = whole[0]["energy_parts_wh.rolling"]
    assert few[1] == f"eco,{whole[0]['id']},{float(f'{float(rolling):.6g}')}"


def test_texts_in_xml_hold_no_characters_that_it_has_no_place_for() -> None:
    assert clean("Rua\x00 <&> \x0b\ud800ç 🚗") == "Rua <&> ç 🚗"


@pytest.mark.parametrize("form", [AnswerFormat.GPX, AnswerFormat.KML, AnswerFormat.PARQUET, AnswerFormat.CSV])
def test_route_to_where_it_begins_is_a_file_too(service: Service, form: AnswerFormat) -> None:
    assert service.route_in(
        form, RouteRequest.model_validate({"start": [8.001, 46.5], "goal": [8.001, 46.5], "soc": 0.5})
    )
