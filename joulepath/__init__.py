"""Energy-aware routing for electric vehicles, from Python: graphs, vehicles, and what is asked of them.

>>> import joulepath
>>> graph, car = joulepath.Graph.load("highlands"), joulepath.Vehicle.load("hyundai-kona-64")
>>> eco, = joulepath.route(graph, car, start=(43.872, -36.433), goal=(43.697, -35.19), soc_frac=0.5)

Numbers go in and come out in the units that their names end in, places are (lat, lon) in degrees, charges are shares
of the usable capacity, 0..1. Results are frozen; those that lie on the map have `__geo_interface__` and
`to_geodataframe()`. docs/python.md describes all of it.
"""

from diagnosis.errors import DiagnosisError
from energy.compiled.progress import Display, compilations
from energy.errors import EnergyError
from joulepath.charging import Charging, ChargingHalt, ChargingHelp, ChargingPlan, ChargingStop, NoChargingPlan, Stay
from joulepath.conditions import Conditions
from joulepath.diagnoses import Diagnosis, diagnose
from joulepath.figures import EnergyParts, Place, Snapped
from joulepath.graph import Graph
from joulepath.matrices import Matrix, matrix
from joulepath.ranges import Band, Range, range
from joulepath.routes import Leg, Route, RouteLinks, Routes, Uncertainty, route
from joulepath.simulations import Simulation, simulate
from joulepath.steps import Step
from joulepath.vehicle import Vehicle
from routing.errors import RoutingError
from routing.places import LinkSpan
from routing.queries import ParetoSettings, Trip
from routing.weights import Weights

__all__ = [
    "Band",
    "Charging",
    "ChargingHalt",
    "ChargingHelp",
    "ChargingPlan",
    "ChargingStop",
    "Conditions",
    "Diagnosis",
    "DiagnosisError",
    "EnergyError",
    "EnergyParts",
    "Graph",
    "Leg",
    "LinkSpan",
    "Matrix",
    "NoChargingPlan",
    "ParetoSettings",
    "Place",
    "Range",
    "Route",
    "RouteLinks",
    "Routes",
    "RoutingError",
    "Simulation",
    "Snapped",
    "Stay",
    "Step",
    "Trip",
    "Uncertainty",
    "Vehicle",
    "Weights",
    "diagnose",
    "matrix",
    "range",
    "route",
    "show_compilation",
    "simulate",
]


def show_compilation(shown: bool = True) -> None:
    """Say on the error output what is compiled, as happens from the import on; False: nothing more."""
    compilations.watch(Display() if shown else None)


if not compilations.watched:
    show_compilation()
