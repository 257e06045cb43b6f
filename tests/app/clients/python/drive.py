"""Drives a service by the client that was generated for it: python drive.py ADDRESS; prints what came back as JSON."""

from __future__ import annotations

import json
import sys

from joulepath_client import Client
from joulepath_client.api.graphs import list_graphs
from joulepath_client.api.range_ import find_range
from joulepath_client.api.route import find_route
from joulepath_client.models import LatLon, LineString, Problem, RangeFeatureCollection, RouteRequest, RouteResponse
from joulepath_client.models.graph_list import GraphList

client = Client(base_url=sys.argv[1])
trip = RouteRequest(start=LatLon(lat=46.5, lon=8.003), goal=LatLon(lat=46.518, lon=8.02), soc=0.4, graph="grid")

graphs = list_graphs.sync(client=client)
assert isinstance(graphs, GraphList)
found = find_route.sync(client=client, body=trip)
assert isinstance(found, RouteResponse)
line = found.routes[0].geometry
assert isinstance(line, LineString)
area = find_range.sync(client=client, lat=46.51, lon=8.01, soc=0.5, graph="grid", bands="3")
assert isinstance(area, RangeFeatureCollection)
trip.graph = "atlantis"
refused = find_route.sync(client=client, body=trip)
assert isinstance(refused, Problem)
print(
    json.dumps(
        {
            "graphs": sorted(graph.name for graph in graphs.graphs),
            "energy_kwh": found.routes[0].energy_kwh,
            "points": len(line.coordinates),
            "bands": len(area.features),
            "problem": [refused.code, refused.status],
        }
    )
)
