"""Commands that ask for routes, areas and energies.

What takes long to import is imported by the command that needs it.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from app.cli import before_after, plan_tables, step_tables, tables
from app.cli.commands.charging import (
    ArriveSocOption,
    AvoidOption,
    ChargingOption,
    ConfidenceOption,
    ConnectorOption,
    DepartOption,
    ExcludeOption,
    ExcludeStationOption,
    GoalSocOption,
    MaxSocOption,
    MinPowerOption,
    MostStopsOption,
    ObjectiveOption,
    OverheadOption,
    PlansOption,
    PreferOption,
    SpeedCapOption,
    StationOption,
    StayOption,
    TimeValueOption,
    ViaStationOption,
    charging_from_options,
)
from app.cli.commands.effects import (
    EffectsOption,
    UncertainOption,
    changes_anything,
    effects_choice,
    refuse_uncertain,
)
from app.cli.commands.json_files import json_in
from app.cli.commands.lean import (
    CompactOption,
    FieldsOption,
    GeometryFormatOption,
    LinksOption,
    OverviewOption,
    RangeFormatOption,
    RouteFormatOption,
    StepsOption,
    ToleranceOption,
    asked_parts,
    chosen_format,
    print_bytes,
)
from app.cli.commands.output import (
    GraphOption,
    JsonOption,
    print_changes,
    print_json,
    print_notes,
    print_places,
    service_for,
)
from app.errors.raised import CommandError
from app.schemas.lean.formats import RANGE_FORMATS, ROUTE_FORMATS
from routing.errors import QueryError

if TYPE_CHECKING:
    from app.schemas.route import RouteRequest, RouteResponse
    from app.service.service import Service

queries = typer.Typer()

VehicleOption = Annotated[str | None, typer.Option("--vehicle", help="id of a vehicle", metavar="ID")]
SocOption = Annotated[float, typer.Option("--soc", help="state of charge at departure, 0..1")]
ReserveOption = Annotated[float, typer.Option("--reserve-soc", help="charge that must be kept, 0..1")]
LinkModelOption = Annotated[str, typer.Option("--link-model", metavar="integrated|printed")]
StopsOption = Annotated[str, typer.Option("--stops", metavar="expected|counted|none|crossings")]
UncertaintyOption = Annotated[bool, typer.Option("--uncertainty", help="with quantiles of what may come out")]
ConditionOption = Annotated[
    list[str] | None,
    typer.Option(
        "--condition", metavar="NAME=VALUE", help="such as ambient_c=-5, payload_kg=200, road=wet; repeatable"
    ),
]


@queries.command()
def route(
    *,
    start: Annotated[str, typer.Option(metavar="LAT,LON|TEXT")],
    goal: Annotated[str, typer.Option(metavar="LAT,LON|TEXT")],
    soc: SocOption,
    via: Annotated[
        list[str] | None, typer.Option(metavar="LAT,LON|TEXT", help="place to go over; repeatable, in order")
    ] = None,
    graph: GraphOption = None,
    vehicle: VehicleOption = None,
    weights: Annotated[str | None, typer.Option(metavar="E,T,D", help="worth of a kWh, an hour, a kilometre")] = None,
    alternatives: Annotated[str | None, typer.Option(metavar="eco,fastest,balanced")] = None,
    pareto: Annotated[
        str | None,
        typer.Option(metavar="E[,N]", help="Pareto set of time and energy within E, such as 0.02, of at most N routes"),
    ] = None,
    reserve_soc: ReserveOption = 0.0,
    link_model: LinkModelOption = "integrated",
    stops: StopsOption = "expected",
    condition: ConditionOption = None,
    effects: EffectsOption = None,
    apply_uncertain: UncertainOption = False,
    compare: Annotated[
        bool, typer.Option("--compare", help="show the routes by the vehicle's file beside those with --effects")
    ] = False,
    uncertainty: UncertaintyOption = False,
    charging: ChargingOption = False,
    arrive_soc: ArriveSocOption = None,
    goal_soc: GoalSocOption = None,
    max_soc: MaxSocOption = None,
    overhead_s: OverheadOption = None,
    connector: ConnectorOption = None,
    min_power_kw: MinPowerOption = None,
    prefer_network: PreferOption = None,
    avoid_network: AvoidOption = None,
    exclude_network: ExcludeOption = None,
    station: StationOption = None,
    exclude_station: ExcludeStationOption = None,
    via_station: ViaStationOption = None,
    stay: StayOption = None,
    depart: DepartOption = None,
    objective: ObjectiveOption = None,
    time_value: TimeValueOption = None,
    confidence: ConfidenceOption = None,
    speed_cap: SpeedCapOption = None,
    most_stops: MostStopsOption = None,
    more_plans: PlansOption = None,
    steps: StepsOption = False,
    links: LinksOption = True,
    geometry_format: GeometryFormatOption = "geojson",
    overview: OverviewOption = "full",
    fields: FieldsOption = None,
    compact: CompactOption = None,
    form: RouteFormatOption = None,
    as_json: JsonOption = False,
) -> None:
    """Routes from one place to another, with charging stops where these are asked for."""
    from app.schemas.route import RouteRequest

    if compare and (effects is None or pareto is not None):
        raise CommandError("--compare is set, allowed: with --effects, without --pareto")
    chosen = chosen_format(form, as_json, ROUTE_FORMATS)
    service = service_for(graph)
    sent = RouteRequest.model_validate(
        {
            "start": _place("start", start),
            "goal": _place("goal", goal),
            "via": [_place(f"via[{k}]", place) for k, place in enumerate(via or [])],
            "soc": soc,
            "vehicle": vehicle,
            "graph": None if graph is None else service.settings.default_graph,
            "weights": None if weights is None else weights_from_text(weights),
            "alternatives": None if alternatives is None else alternatives.split(","),
            "pareto": None if pareto is None else _pareto(pareto),
            "charging": charging_from_options(
                charging,
                stay,
                via_station,
                {"preferred": prefer_network, "avoided": avoid_network, "excluded": exclude_network},
                arrive_soc=arrive_soc,
                goal_soc=goal_soc,
                max_soc=max_soc,
                overhead_s=overhead_s,
                connectors=connector,
                min_power_kw=min_power_kw,
                stations=station,
                excluded_stations=exclude_station,
                departure_time=depart,
                objective=objective,
                time_value_per_h=time_value,
                confidence=confidence,
                speed_caps_kmh=speed_cap,
                most_stops=most_stops,
                alternatives=more_plans,
            ),
            "reserve_soc": reserve_soc,
            "link_model": link_model,
            "stops": stops,
            "conditions": conditions_from_pairs(condition),
            "effects": effects_choice(effects),
            "uncertainty": uncertainty,
            "links": links,
            "steps": steps,
            "geometry_format": geometry_format,
            "overview": overview,
            **asked_parts(fields, compact),
        }
    )
    if compare:
        _compare(service, sent, as_json)
        return
    refuse_uncertain(service, sent.effects, apply_uncertain)
    if chosen is not None:
        print_bytes(service.route_in(chosen, sent))
        return
    answer = service.route(sent)
    console = Console()
    print_places(answer.places)
    console.print(tables.routes_table(answer))
    _print_plans(console, answer)
    if changes_anything(service, sent.effects):
        file = service.route(sent.model_copy(update={"effects": None}))
        print_changes(console, before_after.route_lines(file, answer))
    console.print(tables.parts_table([(found.name, found.energy_parts_kwh) for found in answer.routes]))
    console.print(tables.hot_table(answer.routes))
    if uncertainty:
        console.print(tables.spread_table(answer.routes))
    if steps:
        for found in answer.routes:
            console.print(step_tables.steps_table(found))
    claim = answer.pareto
    if claim is not None and claim.epsilon_frac is not None and claim.energy_slack_kwh is not None:
        console.print(
            f"proven: for any way that keeps the reserve one of these takes at most {1.0 + claim.epsilon_frac:.4f} "
            f"times its time and {claim.energy_slack_kwh:.3f} kWh more"
        )
    print_notes(console, answer.terrain, answer.warnings)


def _print_plans(console: Console, answer: RouteResponse) -> None:
    """Print the charging stops of each route, or why there are none."""
    from app.conversions.charging.plans import departure_of

    departure = departure_of(answer.request)
    for route in answer.routes:
        plan = route.charging
        if plan is not None:
            console.print(plan_tables.plan_table(route, plan, departure))
            powers = plan_tables.power_table(plan)
            if powers is not None:
                console.print(powers)
            for line in (plan_tables.totals_line(plan), *plan_tables.promise_lines(plan), plan_tables.proof_line(plan)):
                console.print(line, markup=False, highlight=False)
            if plan.sources:
                console.print(plan_tables.sources_line(plan.sources), style="dim", markup=False, highlight=False)
    if answer.no_plan is not None:
        for line in plan_tables.no_plan_lines(answer.no_plan):
            console.print(line, style="red", markup=False, highlight=False)


def _compare(service: Service, sent: RouteRequest, as_json: bool) -> None:
    """Show what learned effects would change of a request, and apply nothing."""
    file, learned = service.route(sent.model_copy(update={"effects": None})), service.route(sent)
    if as_json:
        typer.echo(f'{{"file":{file.model_dump_json()},"learned":{learned.model_dump_json()}}}')
        return
    console = Console()
    before_after.print_routes(console, file, learned)
    print_notes(console, learned.terrain, learned.warnings)


@queries.command("range")
def reachable(
    *,
    origin: Annotated[str, typer.Option("--origin", "--start", metavar="LAT,LON|TEXT")],
    soc: SocOption,
    graph: GraphOption = None,
    vehicle: VehicleOption = None,
    bands: Annotated[str, typer.Option(help="number of bands, or charges left", metavar="N|F,F…")] = "1",
    reverse: Annotated[bool, typer.Option("--reverse", help="the area from which the origin is reached")] = False,
    round_trip: Annotated[bool, typer.Option("--round-trip", help="what can be driven to and back")] = False,
    by: Annotated[str, typer.Option(help="charge, energy, time or distance")] = "charge",
    limits: Annotated[str | None, typer.Option(help="in place of bands: kWh, min or km", metavar="F,F…")] = None,
    outline: Annotated[str, typer.Option(help="roads, or filled: smooth, without small holes")] = "roads",
    reserve_soc: ReserveOption = 0.0,
    link_model: LinkModelOption = "integrated",
    stops: StopsOption = "expected",
    condition: ConditionOption = None,
    effects: EffectsOption = None,
    apply_uncertain: UncertainOption = False,
    uncertainty: UncertaintyOption = False,
    tolerance_m: ToleranceOption = None,
    fields: FieldsOption = None,
    compact: CompactOption = None,
    form: RangeFormatOption = None,
    as_json: JsonOption = False,
) -> None:
    """The area that can be reached."""
    from app.schemas.range import RangeRequest, limits_from_text

    chosen = chosen_format(form, as_json, RANGE_FORMATS)
    service = service_for(graph)
    sent = RangeRequest.model_validate(
        {
            "origin": _place("origin", origin),
            "soc": soc,
            "vehicle": vehicle,
            "graph": None if graph is None else service.settings.default_graph,
            "reserve_soc": reserve_soc,
            "bands": _bands(bands),
            "reverse": reverse,
            "round_trip": round_trip,
            "outline": outline,
            "by": by,
            "limits": limits_from_text(limits),
            "link_model": link_model,
            "stops": stops,
            "conditions": conditions_from_pairs(condition),
            "effects": effects_choice(effects),
            "uncertainty": uncertainty,
            "tolerance_m": tolerance_m,
            **asked_parts(fields, compact),
        }
    )
    refuse_uncertain(service, sent.effects, apply_uncertain)
    if chosen is not None:
        print_bytes(service.range_in(chosen, sent))
        return
    answer = service.range(sent)
    console = Console()
    print_places(answer.places)
    console.print(tables.bands_table(answer))
    if changes_anything(service, sent.effects):
        file = service.range(sent.model_copy(update={"effects": None}))
        print_changes(console, [before_after.area_line(file, answer)])
    print_notes(console, answer.terrain, answer.warnings)


@queries.command()
def simulate(
    *,
    source: Annotated[
        Path, typer.Argument(metavar="FILE.json|-", help="body of POST /simulate; - reads it from input")
    ],
    model: Annotated[
        str | None,
        typer.Option(metavar="fast|timestep", help="instead of the body's: link by link, or in steps of 0.1 s"),
    ] = None,
    stops: Annotated[
        str | None, typer.Option(metavar="expected|counted|none|crossings", help="instead of the body's")
    ] = None,
    profile: Annotated[bool, typer.Option("--profile", help="have the speed along the way in the answer")] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="draw the speed along the way by both models")
    ] = None,
    effects: EffectsOption = None,
    apply_uncertain: UncertainOption = False,
    as_json: JsonOption = False,
) -> None:
    """Energy and time of driving given links."""
    from app.schemas.simulation import SimulateRequest

    if plot is not None and plot.suffix.lower() != ".png":
        raise QueryError("plot", repr(str(plot)), "a file name that ends in .png")
    body = json_in(source)
    asked = {"model": model, "stops": stops, "profile": profile or None, "effects": effects_choice(effects)}
    if isinstance(body, dict):
        body |= {name: value for name, value in asked.items() if value is not None}
    service = service_for(None)
    sent = SimulateRequest.model_validate(body)
    if effects is not None:  # those of the body are the sender's own choice
        refuse_uncertain(service, sent.effects, apply_uncertain)
    answer = service.simulate(sent)
    if plot is not None:
        from app.cli.speed_plot import draw_speeds

        course, drawn = service.speed_drawing(sent)
        draw_speeds(plot, drawn, course.chain.length_m, course.chain.speed_limit_mps, course.vehicle.name)
    if as_json:
        print_json(answer)
        return
    console = Console()
    console.print(tables.simulation_table(answer))
    console.print(tables.parts_table([("sum", answer.energy_parts_kwh)]))
    if changes_anything(service, sent.effects):
        file = service.simulate(sent.model_copy(update={"effects": None}))
        print_changes(console, [before_after.drive_line(file, answer)])
    if answer.profile is not None:
        console.print(tables.profile_table(answer.profile))
    print_notes(console, answer.terrain, answer.warnings)


def _place(field: str, text: str) -> dict[str, float] | str:
    """A place as requests have it: coordinates, or the text itself, which is looked up."""
    if not text.strip():
        raise QueryError(field, repr(text), "LAT,LON in degrees, such as 46.5,8.0, or the name of a place")
    try:
        lat, lon = (float(part) for part in text.split(","))
    except ValueError:
        return text
    return {"lat": lat, "lon": lon}


def weights_from_text(text: str) -> dict[str, float]:
    """Weights of a request out of E,T,D; raises QueryError."""
    try:
        energy, time, distance = (float(part) for part in text.split(","))
    except ValueError:
        raise QueryError("weights", repr(text), "E,T,D: three numbers, such as 1,5,0") from None
    return {"energy": energy, "time": time, "distance": distance}


def _pareto(text: str) -> dict[str, float]:
    try:
        epsilon, *most = text.split(",")
        asked: dict[str, float] = {"epsilon_frac": float(epsilon)}
        return asked | ({"most": int(*most)} if most else {})
    except (TypeError, ValueError):
        raise QueryError("pareto", repr(text), "E or E,N: a number and a whole one, such as 0.02,10") from None


def _bands(text: str) -> int | list[float]:
    """Bands as in the address of GET /range."""
    from pydantic_core import PydanticCustomError

    from app.schemas.range import bands_from_text

    try:
        return bands_from_text(text)
    except PydanticCustomError as error:
        raise QueryError("bands", repr(text), error.message()) from error


def conditions_from_pairs(given: list[str] | None) -> dict[str, object] | None:
    """Conditions of a request out of NAME=VALUE pairs; numbers and true or false as in JSON, all else is text."""
    if not given:
        return None
    found: dict[str, object] = {}
    for pair in given:
        name, separator, value = pair.partition("=")
        if not separator:
            raise QueryError("condition", pair, "NAME=VALUE, such as ambient_c=-5")
        try:
            found[name] = json.loads(value)
        except (ValueError, RecursionError):
            found[name] = value
    return found
