"""The command line; each command asks the same use cases as HTTP."""

from __future__ import annotations

import gc
import importlib
import json
import signal
from typing import Annotated, Any

import typer
from pydantic import ValidationError
from rich.console import Console
from typer.core import TyperGroup

from app.access.errors import KeyFileError
from app.cli.commands.batch import batches
from app.cli.commands.compare import comparing
from app.cli.commands.diagnose import diagnosing
from app.cli.commands.graphs import graphs, making
from app.cli.commands.keys import keys
from app.cli.commands.output import GraphOption, service_for, settings_for
from app.cli.commands.places import places, searching
from app.cli.commands.prove import proving
from app.cli.commands.queries import queries
from app.cli.commands.stations import stations
from app.cli.commands.vehicles import vehicles
from app.errors.raised import CommandError
from app.settings import MOST_WORKERS, Settings
from app.sharing.sources import GraphsOnDisk
from app.store.errors import StoreError
from energy.compiled.progress import Display, compilations
from energy.errors import EnergyError, Refusal
from routing.errors import RoutingError


def _validation_message(error: ValidationError) -> str:
    from fastapi.exceptions import RequestValidationError

    from app.errors.table import problem_of

    return problem_of(RequestValidationError(error.errors()), "").detail


class ReportingGroup(TyperGroup):
    """Commands that say what they compile, and whose expected errors end in one red line and exit code 2."""

    def invoke(self, ctx: Any) -> Any:
        """Run a command."""
        compilations.watch(Display())
        try:
            return super().invoke(ctx)
        except ValidationError as error:
            message = _validation_message(error)
        except (Refusal, EnergyError, RoutingError, StoreError, KeyFileError, CommandError) as error:
            message = str(error)
        except json.JSONDecodeError as error:
            message = f"not valid JSON: {error}"
        except OSError as error:
            message = f"{error.strerror or error}{f': {error.filename}' if error.filename else ''}"
        message = message.encode("utf-8", "replace").decode("utf-8")  # a lone surrogate can't be printed
        Console(stderr=True, soft_wrap=True).print(message, style="red", markup=False, highlight=False)
        raise typer.Exit(2)


cli = typer.Typer(cls=ReportingGroup, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
cli.add_typer(queries)
cli.add_typer(batches)
cli.add_typer(comparing)
cli.add_typer(diagnosing)
cli.add_typer(making)
cli.add_typer(proving)
cli.add_typer(vehicles, name="vehicles")
cli.add_typer(graphs, name="graphs")
cli.add_typer(stations, name="stations")
cli.add_typer(places, name="places")
cli.add_typer(searching)
cli.add_typer(keys, name="keys")


def main() -> None:
    """Entry point."""
    cli()


@cli.callback()
def joulepath() -> None:
    """Routes that take the least energy, and areas that can be reached, for electric vehicles, from physics."""


@cli.command()
def serve(
    host: Annotated[str | None, typer.Option(help="address to listen on")] = None,
    port: Annotated[int | None, typer.Option(help="port to listen on", min=0, max=65535)] = None,
    graph: GraphOption = None,
    workers: Annotated[
        int | None, typer.Option(help="processes that serve as one, on one copy of the graphs", min=1, max=MOST_WORKERS)
    ] = None,
) -> None:
    """Serve HTTP; settings come from JOULEPATH_… variables too."""
    from app.http.gate import listening_settings
    from app.http.server import run_server
    from app.logs import configure_logs
    from app.main import create_app

    if hasattr(signal, "SIGHUP"):  # which reloads graphs; one that comes before they are loaded would end the process
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    chosen, source = settings_for(graph)
    configure_logs(chosen)
    address = host or chosen.host
    settings = listening_settings(chosen, address)
    console = Console(stderr=True)
    if settings.keys_file is None and settings.open_without_keys:
        console.print("open without keys: whoever reaches this server may change what it holds", style="yellow")
    if (workers or settings.workers) > 1:
        _serve_with_workers(settings.model_copy(update={"workers": workers or settings.workers}), source, address, port)
        return
    service = service_for(graph)
    console.print(f"loading graphs: {', '.join(service.atlas.names)}", markup=False, highlight=False)
    service.load_all()
    if (compiled := compilations.state) is not None:
        console.print(f"{compiled.done_count} kernels compiled in {compiled.seconds:.0f} s", highlight=False)
    graphs_line = f"graphs: {', '.join(service.atlas.names)}; {len(service.vehicles)} bundled vehicles"
    console.print(f"{graphs_line}, others in {service.database.shown_url}", markup=False, highlight=False)
    application = create_app(settings, service)
    # what is loaded stays: full collections, which areas with their many points set off, need not look at it again
    gc.collect()
    gc.freeze()
    run_server(application, settings, address, settings.port if port is None else port)


def _serve_with_workers(settings: Settings, source: GraphsOnDisk, host: str, port: int | None) -> None:
    from app.serving.supervisor import supervise

    console = Console(stderr=True, soft_wrap=True)
    console.print(f"{settings.workers} workers, graphs: {', '.join(source.folders())}", markup=False, highlight=False)
    supervise(
        settings,
        source,
        host,
        settings.port if port is None else port,
        lambda line: console.print(line, markup=False, highlight=False),
    )


@cli.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []})
def bench(ctx: typer.Context) -> None:
    """Measure speed and memory; arguments are passed on, --help lists them."""
    try:
        benchmarks = importlib.import_module("benchmarks.run")  # beside the packages in a checkout, not installed
    except ModuleNotFoundError as error:
        if not (error.name or "").startswith("benchmarks"):
            raise
        raise CommandError("benchmarks are not installed: run from a checkout of the project") from error
    raise typer.Exit(benchmarks.main(ctx.args))
