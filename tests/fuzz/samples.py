"""Small files of every kind that people bring, which mutations are made of."""

from __future__ import annotations

import io
import json
import tempfile
from pathlib import Path

import numpy as np
import osmium
import pyarrow as pa
from pyarrow import parquet
from rasterio import Affine
from rasterio.io import MemoryFile

from routing.graph.networkx_graph import write_graphml
from routing.importers.region import import_region
from tests.diagnosis.recording_rows import I3_HEADER, i3_rows, plain_rows
from tests.fuzz.station_samples import station_samples

_SECONDS = 40
_BEGIN_S = 1_700_000_000

# corners of a block of streets in Andorra's latitude, 0.01° apart, and a road over its middle
_NODES = {1: (42.0, 1.5), 2: (42.0, 1.51), 3: (42.01, 1.51), 4: (42.01, 1.5), 5: (42.005, 1.505), 6: (42.0, 1.505)}
_NODE_TAGS = {
    2: {"highway": "traffic_signals", "traffic_signals:direction": "forward"},
    4: {"barrier": "gate", "access": "yes"},
    5: {"highway": "stop", "addr:country": "AD"},
}
_WAYS = {
    10: ([1, 6, 2, 3], {"highway": "residential", "name": "Ring", "maxspeed": "50", "oneway": "no"}),
    11: ([3, 4, 1], {"highway": "secondary", "maxspeed:forward": "60 mph", "motor_vehicle:backward": "yes"}),
    12: ([1, 5, 3], {"highway": "tertiary", "maxspeed:conditional": "30 @ (Mo-Fr 07:00-17:00); 60 @ wet"}),
    13: ([6, 5], {"highway": "service", "bridge": "yes", "maxspeed": "ES:urban"}),
    14: ([1, 2, 3, 1], {"landuse": "residential"}),
}
_RELATIONS = {
    20: (
        [("w", 12, "from"), ("n", 5, "via"), ("w", 13, "to")],
        {"type": "restriction", "restriction": "no_right_turn"},
    ),
    21: ([("w", 13, "from"), ("w", 12, "via"), ("w", 10, "to")], {"type": "restriction", "restriction": "no_u_turn"}),
    22: ([("w", 10, "outer")], {"boundary": "administrative", "admin_level": "2", "ISO3166-1": "AD"}),
}


def _osm_xml() -> bytes:
    def tags(pairs: dict[str, str]) -> str:
        return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in pairs.items())

    lines = ["<?xml version='1.0' encoding='UTF-8'?>", "<osm version='0.6'>"]
    for ref, (lat, lon) in _NODES.items():
        lines.append(f'<node id="{ref}" version="1" lat="{lat}" lon="{lon}">{tags(_NODE_TAGS.get(ref, {}))}</node>')
    lines.append('<node id="7" action="delete" visible="true" version="1" lat="42" lon="1.5"/>')
    for ref, (points, pairs) in _WAYS.items():
        nodes = "".join(f'<nd ref="{point}"/>' for point in points)
        lines.append(f'<way id="{ref}" version="1">{nodes}{tags(pairs)}</way>')
    kinds = {"n": "node", "w": "way"}
    for ref, (members, pairs) in _RELATIONS.items():
        inner = "".join(f'<member type="{kinds[kind]}" ref="{m}" role="{role}"/>' for kind, m, role in members)
        lines.append(f'<relation id="{ref}" version="1">{inner}{tags(pairs)}</relation>')
    return "\n".join([*lines, "</osm>"]).encode()


def _osm_pbf() -> bytes:
    """Without compression, so that a changed byte changes an object and not a checksum."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.osm.pbf"
        with osmium.SimpleWriter(osmium.io.File(str(path), "pbf,pbf_compression=none")) as writer:
            for ref, (lat, lon) in _NODES.items():
                writer.add_node(osmium.osm.mutable.Node(id=ref, location=(lon, lat), tags=_NODE_TAGS.get(ref, {})))
            for ref, (points, pairs) in _WAYS.items():
                writer.add_way(osmium.osm.mutable.Way(id=ref, nodes=points, tags=pairs))
            for ref, (members, pairs) in _RELATIONS.items():
                writer.add_relation(osmium.osm.mutable.Relation(id=ref, members=members, tags=pairs))
        return path.read_bytes()


def _graphml() -> bytes:
    node_keys = ("y", "x", "street_count", "highway", "elevation")
    edge_keys = ("osmid", "highway", "maxspeed", "speed_kph", "name", "oneway", "length", "geometry", "bridge")
    lines = ["<?xml version='1.0' encoding='utf-8'?>", '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">']
    lines.append('<key id="crs" for="graph" attr.name="crs" attr.type="string"/>')
    lines += [f'<key id="n{key}" for="node" attr.name="{key}" attr.type="string"/>' for key in node_keys]
    lines += [f'<key id="e{key}" for="edge" attr.name="{key}" attr.type="string"/>' for key in edge_keys]
    lines.append('<graph edgedefault="directed"><data key="crs">epsg:4326</data>')
    nodes = [("42.0", "1.5", "3", "", "900"), ("42.0", "1.51", "3", "stop", "905.5"), ("42.01", "1.5", "2", "", "910")]
    for ref, values in enumerate(nodes, start=1):
        data = "".join(f'<data key="n{key}">{value}</data>' for key, value in zip(node_keys, values, strict=True))
        lines.append(f'<node id="{ref}">{data}</node>')
    bent = "LINESTRING (1.5 42, 1.505 41.999, 1.51 42)"
    back = "LINESTRING (1.51 42, 1.505 41.999, 1.5 42)"
    edges = [
        (
            1,
            2,
            ("[100, 101]", "['tertiary', 'residential']", "['50', '30']", "nan", "A", "False", "860.5", bent, "yes"),
        ),
        (2, 1, ("[101, 100]", "tertiary", "50", "", "A", "False", "860.5", back, "")),
        (2, 3, ("102", "residential", "", "48.5", "None", "True", "1386.1", "", "")),
        (3, 1, ("103", "primary", "60 mph", "", "B", "True", "1110.6", "", "no")),
    ]
    for u, v, values in edges:
        data = "".join(f'<data key="e{key}">{value}</data>' for key, value in zip(edge_keys, values, strict=True))
        lines.append(f'<edge source="{u}" target="{v}" id="0">{data}</edge>')
    return "\n".join([*lines, "</graph></graphml>"]).encode()


def _export() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        source, path = Path(folder) / "map.osm", Path(folder) / "export.graphml"
        source.write_bytes(_osm_xml())
        write_graphml(import_region(source, [], "map"), path)
        return path.read_bytes()


def _tile(coloured: bool) -> bytes:
    rows, columns = np.mgrid[0:20, 0:20]
    height_m = (900.0 + 2.0 * rows + 3.0 * columns).astype(np.float32)
    bands = height_m[None]
    if coloured:  # terrarium
        code = height_m + 32768.0
        bands = np.stack([code // 256, code % 256, np.zeros_like(code)]).astype(np.uint8)
    place = Affine(0.001, 0.0, 1.495, 0.0, -0.001, 42.015)
    kinds = {"driver": "GTiff", "width": 20, "height": 20, "crs": "EPSG:4326", "transform": place}
    with MemoryFile() as memory:
        with memory.open(count=len(bands), dtype=bands.dtype, **kinds) as raster:
            raster.write(bands)
            if not coloured:
                raster.nodata = -9999.0
                raster.units = ("m",)
        return bytes(memory.read())


def _csv(columns: dict[str, list[object]], delimiter: str = ",") -> bytes:
    rows = zip(*columns.values(), strict=True)
    return "\n".join([delimiter.join(columns), *(delimiter.join(map(str, row)) for row in rows)]).encode()


def _recordings() -> dict[str, bytes]:
    plain = [[float(cell) for cell in row] for row in plain_rows(_SECONDS)]
    time, kmh, watt = (list(column) for column in zip(*plain, strict=True))
    clock = [f"2023-11-14 22:{13 + k // 60:02d}:{k % 60:02d}" for k in range(_SECONDS)]
    soc: list[object] = [80.0 - 0.02 * k for k in range(_SECONDS)]
    lat: list[object] = [42.0 + 1e-4 * k for k in range(_SECONDS)]
    lon: list[object] = [1.5] * _SECONDS
    up: list[object] = [900.0 + 0.1 * k for k in range(_SECONDS)]
    ones: list[object] = [1] * _SECONDS
    abrp = [
        {"utc": _BEGIN_S + t, "speed": v, "power": p / 1000.0, "soc": s, "lat": y, "lon": 1.5, "is_charging": False}
        for t, v, p, s, y in zip(time, kmh, watt, soc, lat, strict=True)
    ]
    points = "".join(
        f'<trkpt lat="{y}" lon="1.5"><ele>{h}</ele><time>{t.replace(" ", "T")}Z</time></trkpt>\n'
        for y, h, t in zip(lat, up, clock, strict=True)
    )
    kilowatt: list[object] = [p / 1000.0 for p in watt]
    table = pa.table({"time_s": time, "speed_kmh": kmh, "power_w": watt, "lat": lat, "lon": lon})
    packed = io.BytesIO()
    parquet.write_table(table, packed, compression="none")
    all_columns: dict[str, list[object]] = {
        "time_s": list(time), "speed_kmh": list(kmh), "power_w": list(watt), "soc_pct": soc, "lat": lat, "lon": lon,
        "elevation_m": up,
    }  # fmt: skip
    long = ['"SECONDS";"PID";"VALUE";"UNITS"']
    for t, v, p in zip(time, kmh, watt, strict=True):
        long.append(f'"{t}";"Vehicle speed";"{v}";"km/h"')
        long.append(f'"{t}";"[BMS] HV battery power";"{p / 1000.0}";"kW"')
    i3 = "\n".join([I3_HEADER, *(";".join(row) for row in i3_rows(_SECONDS))])
    device = [f"14-Nov-2023 22:13:{k:02d}.000" for k in range(_SECONDS)]
    volts: list[object] = [380.0] * _SECONDS
    amps: list[object] = [p / 380.0 for p in watt]
    return {
        "plain.csv": _csv(all_columns),
        "semicolons.csv": _csv(all_columns, ";"),
        "i3.csv": i3.encode("latin-1"),
        "abrp.jsonl": "\n".join(map(json.dumps, abrp)).encode(),
        "array.json": json.dumps(abrp).encode(),
        "long.csv": "\n".join(long).encode(),
        "wide.csv": _csv({
            "time": list(clock), "Vehicle speed (km/h)": list(kmh), "[BMS] HV battery power (kW)": kilowatt,
            "HV battery voltage (V)": volts,
        }),
        "torque.csv": _csv({
            "GPS Time": list(clock), "Device Time": list(device), "Longitude": lon, "Latitude": lat,
            "Speed (OBD)(km/h)": list(kmh), "HV battery voltage (V)": volts, "HV battery current (A)": amps,
        }),
        "leaf_spy.csv": _csv({
            "Date/Time": list(clock), "Lat": lat, "Long": lon, "Elv": up, "Speed": list(kmh), "Gids": ones,
            "SOC": [int(8000 - k) for k in range(_SECONDS)], "Pack Volts": volts, "Pack Amps": amps,
            "Pack T1 C": ones, "Ambient": ones, "epoch time": [_BEGIN_S + k for k in range(_SECONDS)],
        }),
        "teslamate.csv": _csv({
            "drive_id": ones, "date": list(clock), "speed": list(kmh), "power": kilowatt,
            "odometer": [12_000.0 + sum(kmh[:k]) / 3600.0 for k in range(_SECONDS)],
            "latitude": lat, "longitude": lon, "elevation": up, "battery_level": soc,
        }),
        "ovms.csv": _csv({
            "timestamp": list(clock), "v.p.speed": list(kmh), "v.b.power": kilowatt, "v.b.soc": soc,
            "v.p.latitude": lat, "v.p.longitude": lon,
        }),
        "totals.csv": (
            b"trip,distance_km,duration_min,energy_kwh,ambient_c,climb_m\na,20,30,4.2,-3,50\nb,10,12,1.7,4,0\n"
        ),
        "track.gpx": (
            "<?xml version='1.0' encoding='UTF-8'?>\n<gpx version='1.1' xmlns='http://www.topografix.com/GPX/1/1'>"
            f"<trk><trkseg>\n{points}</trkseg></trk></gpx>"
        ).encode(),
        "drive.parquet": packed.getvalue(),
    }  # fmt: skip


def samples() -> dict[str, bytes]:
    """Content of small files, each of which is read without a word, by name."""
    return {
        "map.osm": _osm_xml(),
        "map.osm.pbf": _osm_pbf(),
        "graph.graphml": _graphml(),
        "export.graphml": _export(),
        "heights.tif": _tile(coloured=False),
        "colours.tif": _tile(coloured=True),
        **_recordings(),
        **station_samples(),
    }
