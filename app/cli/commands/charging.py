"""What commands say of charging stops, as a part of requests."""

from __future__ import annotations

from typing import Annotated, Any, Final

import typer

from app.errors.raised import CommandError
from routing.errors import QueryError

STAY_ALLOWED: Final = "PLACE,MIN or PLACE,MIN,KW: a position in via from 0, or goal, and numbers, such as goal,600,11"

ChargingOption = Annotated[bool, typer.Option("--charging", help="plan charging stops where the charge is not enough")]
ArriveSocOption = Annotated[
    float | None, typer.Option("--arrive-soc", help="least charge on arrival at stops, 0..1", metavar="F")
]
GoalSocOption = Annotated[
    float | None, typer.Option("--goal-soc", help="least charge on arrival at the goal, 0..1", metavar="F")
]
MaxSocOption = Annotated[
    float | None, typer.Option("--max-soc", help="charge at which stations are left at most, 0..1", metavar="F")
]
OverheadOption = Annotated[
    float | None, typer.Option("--overhead-s", help="of every stop beside charging [s]", metavar="S")
]
ConnectorOption = Annotated[
    list[str] | None, typer.Option("--connector", help="plug to use, such as ccs2; repeatable", metavar="NAME")
]
MinPowerOption = Annotated[
    float | None, typer.Option("--min-power-kw", help="least output of a socket [kW]", metavar="KW")
]
PreferOption = Annotated[
    list[str] | None, typer.Option("--prefer-network", help="network or operator; repeatable", metavar="NAME")
]
AvoidOption = Annotated[
    list[str] | None, typer.Option("--avoid-network", help="network or operator; repeatable", metavar="NAME")
]
ExcludeOption = Annotated[
    list[str] | None, typer.Option("--exclude-network", help="network or operator; repeatable", metavar="NAME")
]
StationOption = Annotated[
    list[str] | None, typer.Option("--station", help="id of one of the only stations to stop at; repeatable")
]
ExcludeStationOption = Annotated[
    list[str] | None, typer.Option("--exclude-station", help="id of a station not to stop at; repeatable")
]
ViaStationOption = Annotated[
    list[str] | None,
    typer.Option(
        "--via-station",
        help="a via point, by its position from 0, that is a station, at which the vehicle charges first; repeatable",
        metavar="PLACE,ID",
    ),
]
StayOption = Annotated[
    list[str] | None,
    typer.Option(
        "--stay",
        help="a stay that is taken anyway, at a via point by its position from 0 or at the goal; repeatable",
        metavar="PLACE,MIN[,KW]",
    ),
]
DepartOption = Annotated[
    str | None,
    typer.Option("--depart", help="local time, for opening hours and arrivals", metavar="YYYY-MM-DDTHH:MM"),
]
ObjectiveOption = Annotated[
    str | None, typer.Option("--objective", help="what a plan has least of", metavar="time|energy|cost")
]
TimeValueOption = Annotated[
    float | None, typer.Option("--time-value", help="an hour's worth where cost counts", metavar="N")
]
ConfidenceOption = Annotated[
    float | None, typer.Option("--confidence", help="with which charges on arrival are kept", metavar="0.5..0.999")
]
SpeedCapOption = Annotated[
    list[float] | None, typer.Option("--speed-cap", help="highest speed to try, too; repeatable", metavar="KMH")
]
MostStopsOption = Annotated[int | None, typer.Option("--most-stops", help="stations at most", metavar="N")]
PlansOption = Annotated[
    int | None, typer.Option("--more-plans", help="further plans: fewest stops, fastest, most reserve", metavar="0..3")
]


def charging_from_options(
    asked: bool, stay: list[str] | None, via_station: list[str] | None, networks: dict[str, Any], **given: Any
) -> Any:
    """The part `charging` of a request, None where no stops are asked for; what is not given stays at its default.

    networks: lists by preferred, avoided, excluded. given: other fields by name, None or empty where not given. Raises
    CommandError where something is given without --charging, QueryError on a stay that can't be read.
    """
    fields = {name: value for name, value in given.items() if value is not None and value != []}
    if stay:
        fields["stays"] = [_stay(k, text) for k, text in enumerate(stay)]
    if via_station:
        fields["via_stations"] = [_via_station(k, text) for k, text in enumerate(via_station)]
    named = {kind: names for kind, names in networks.items() if names}
    if named:
        fields["networks"] = named
    if not asked:
        if fields:
            names = ", ".join(sorted(fields))
            raise CommandError(f"--charging is missing, required with options of charging stops ({names})")
        return None
    return fields


def _stay(k: int, text: str) -> dict[str, object]:
    place, *numbers = text.split(",")
    try:
        at: int | str = place if place == "goal" else int(place)
        minutes, *power = map(float, numbers)
        if len(power) > 1:
            raise ValueError(text)
    except ValueError:
        raise QueryError(f"charging.stays[{k}]", repr(text), STAY_ALLOWED) from None
    return {"at": at, "minutes": minutes, **({"power_kw": power[0]} if power else {})}


def _via_station(k: int, text: str) -> dict[str, object]:
    place, comma, station = text.partition(",")
    if not (comma and place.isdecimal()):
        raise QueryError(f"charging.via_stations[{k}]", repr(text), "PLACE,ID: a position in via from 0, and an id")
    return {"via": int(place), "station": station}
