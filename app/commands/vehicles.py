"""Commands on vehicles."""

from __future__ import annotations

from typing import Annotated

import typer

from app import tables
from app.commands.output import JsonOption, service_for, show

vehicles = typer.Typer(no_args_is_help=True, help="The vehicles that requests can name.")


@vehicles.command("list")
def list_vehicles(as_json: JsonOption = False) -> None:
    """All vehicles."""
    show(service_for(None).list_vehicles(), tables.vehicles_table, as_json)


@vehicles.command("show")
def show_vehicle(vehicle_id: Annotated[str, typer.Argument(metavar="ID")], as_json: JsonOption = False) -> None:
    """One vehicle with the source of each number."""
    show(service_for(None).show_vehicle(vehicle_id), tables.vehicle_table, as_json)
