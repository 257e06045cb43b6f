"""Commands on vehicles.

What takes long to import is imported by the command that needs it.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from app.cli import tables
from app.cli.commands.json_files import json_in
from app.cli.commands.output import JsonOption, print_json, service_for, show
from app.errors.raised import CommandError

if TYPE_CHECKING:
    from app.schemas.vehicles.services import NewVehicle

vehicles = typer.Typer(no_args_is_help=True, help="The vehicles that requests can name: bundled, and in the database.")

IdArgument = Annotated[str, typer.Argument(metavar="ID")]


@vehicles.command("list")
def list_vehicles(as_json: JsonOption = False) -> None:
    """All vehicles; the bundled ones where the database of the others is not available."""
    answer = service_for(None).fleet.list(needs_store=False)
    show(answer, tables.vehicles_table, as_json)
    if not as_json:
        for warning in answer.warnings:
            Console(stderr=True).print(f"warning: {warning}", style="yellow", markup=False, highlight=False)


@vehicles.command("show")
def show_vehicle(vehicle_id: IdArgument, as_json: JsonOption = False) -> None:
    """One vehicle with the source of each number."""
    show(service_for(None).show_vehicle(vehicle_id), tables.vehicle_table, as_json)


@vehicles.command("add")
def add_vehicle(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="FILE.toml|FILE.json",
            help="a vehicle file, or what `vehicles show --json` prints, or the parameters of TomTom, HERE or Mapbox"
            " with their `format`",
        ),
    ],
    as_json: JsonOption = False,
) -> None:
    """Store a vehicle in the database, in place of the stored one of its id.

    Its id is the one in the file, or else the file's name.
    """
    vehicle_id, sent = _vehicle_in(path)
    detail, created = service_for(None).put_vehicle(vehicle_id, sent)
    if as_json:
        print_json(detail)
    else:
        Console().print(tables.vehicle_table(detail))
        _say(f"{vehicle_id} {'added' if created else 'replaced'}")


@vehicles.command("remove")
def remove_vehicle(vehicle_id: IdArgument, as_json: JsonOption = False) -> None:
    """Remove a vehicle from the database."""
    service_for(None).remove_vehicle(vehicle_id)
    if as_json:
        typer.echo(json.dumps({"removed": vehicle_id}))
    else:
        _say(f"{vehicle_id} removed")


@vehicles.command("check")
def check_vehicles(
    vehicle_ids: Annotated[list[str] | None, typer.Argument(metavar="[ID]...", help="by default all")] = None,
    as_json: JsonOption = False,
) -> None:
    """Consumption of vehicles on EPA's driving cycles, beside what their files say is published."""
    show(service_for(None).check_vehicles(vehicle_ids or []), tables.checks_table, as_json)


def _vehicle_in(path: Path) -> tuple[str, NewVehicle]:
    """Id and vehicle of a file."""
    from pydantic import TypeAdapter

    from app.conversions.vehicle import vehicle_detail
    from app.schemas.vehicles.services import NewVehicleBody
    from energy.errors import EnergyError
    from energy.vehicle.files import load_vehicle

    if path.suffix == ".toml":
        try:
            vehicle = load_vehicle(path)
        except EnergyError:
            raise
        except RecursionError as error:
            raise CommandError(f"{path} is nested too deeply") from error
        except ValueError as error:  # what tomllib raises on a long whole number
            raise CommandError(f"{path}: {error}") from error
        content: object = vehicle_detail(vehicle).model_dump(mode="json")
    else:
        content = json_in(path)
    if not isinstance(content, dict):
        raise CommandError(f"{path} holds no JSON object, allowed: a vehicle as `vehicles show --json` prints it")
    vehicle_id = content.pop("id", path.stem)
    body: TypeAdapter[NewVehicle] = TypeAdapter(NewVehicleBody)
    return str(vehicle_id), body.validate_python(content)


def _say(text: str) -> None:
    Console(stderr=True).print(text, markup=False, highlight=False)
