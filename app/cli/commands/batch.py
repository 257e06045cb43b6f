"""Commands that answer many requests at a time: a matrix of places, and files of route requests."""

from __future__ import annotations

import os
import time
from collections import Counter
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from rich.console import Console

from app.cli.commands.effects import EffectsOption, UncertainOption, effects_choice, refuse_uncertain
from app.cli.commands.lean import (
    CompactOption,
    FieldsOption,
    MatrixFormatOption,
    asked_parts,
    chosen_format,
    print_bytes,
)
from app.cli.commands.output import GraphOption, JsonOption, print_notes, service_for
from app.cli.commands.progress import stage_bars, whole_reporter
from app.cli.commands.queries import (
    ConditionOption,
    LinkModelOption,
    ReserveOption,
    SocOption,
    StopsOption,
    VehicleOption,
    conditions_from_pairs,
    weights_from_text,
)
from app.errors.raised import CommandError
from app.schemas.lean.formats import MATRIX_FORMATS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.cli.batch.answers import RowAnswer
    from app.cli.batch.requests import NamedPlace, RequestRow
    from app.schemas.matrix import MatrixResponse

batches = typer.Typer()

ROWS_A_CALL: Final = 8  # so that what Dask takes for a call, about a millisecond, does not count
SHOWN_CODES: Final = 5
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        help="address of a running Dask scheduler, whose workers see the same folders; without it, threads of its own",
        metavar="tcp://HOST:PORT",
    ),
]
ThreadsOption = Annotated[
    int | None, typer.Option("--threads", help="without --scheduler, by default one a core", min=1, max=1024)
]


@batches.command()
def matrix(
    *,
    places: Annotated[Path, typer.Argument(metavar="PLACES.csv", help="columns lat, lon and, if wanted, id")],
    soc: SocOption,
    targets: Annotated[
        Path | None, typer.Option(metavar="PLACES.csv", help="places to reach; without it, all of the first file")
    ] = None,
    graph: GraphOption = None,
    vehicle: VehicleOption = None,
    weights: Annotated[str | None, typer.Option(metavar="E,T,D", help="worth of a kWh, an hour, a kilometre")] = None,
    reserve_soc: ReserveOption = 0.0,
    link_model: LinkModelOption = "integrated",
    stops: StopsOption = "expected",
    condition: ConditionOption = None,
    effects: EffectsOption = None,
    apply_uncertain: UncertainOption = False,
    scheduler: SchedulerOption = None,
    threads: ThreadsOption = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.csv|.parquet", help="write one line a pair of places")
    ] = None,
    fields: FieldsOption = None,
    compact: CompactOption = None,
    form: MatrixFormatOption = None,
    as_json: JsonOption = False,
) -> None:
    """Energy, time, distance and charge of the drives from many places to many."""
    from app.cli.batch.matrix_table import write_pairs
    from app.cli.batch.requests import named_places
    from app.cli.batch.results import PAIR_KINDS, check_results_name
    from app.cli.batch.scheduling import dask_distributed
    from app.exports.answers import matrix_in

    dask_distributed()
    chosen = chosen_format(form, as_json, MATRIX_FORMATS)
    if out is not None:
        check_results_name(out, PAIR_KINDS, [places, *([] if targets is None else [targets])])
    sources = named_places(places)
    reached = sources if targets is None else named_places(targets)
    body = {
        "sources": [_place(place) for place in sources],
        "targets": None if targets is None else [_place(place) for place in reached],
        "soc": soc,
        "vehicle": vehicle,
        "weights": None if weights is None else weights_from_text(weights),
        "reserve_soc": reserve_soc,
        "link_model": link_model,
        "stops": stops,
        "conditions": conditions_from_pairs(condition),
        "effects": effects_choice(effects),
        **asked_parts(fields, compact),
    }
    answer = _searched(body, graph, scheduler, threads, apply_uncertain=apply_uncertain)
    if out is not None:
        write_pairs(out, answer, sources, reached)
    if chosen is not None:
        print_bytes(matrix_in(chosen, answer))
        return
    from app.cli import tables

    console = Console()
    console.print(tables.matrix_table(answer, [place.id for place in sources], [place.id for place in reached]))
    print_notes(console, answer.terrain, answer.warnings)


def _place(place: NamedPlace) -> dict[str, float]:
    return {"lat": place.lat_deg, "lon": place.lon_deg}


def _searched(
    body: dict[str, Any], graph: str | None, scheduler: str | None, threads: int | None, *, apply_uncertain: bool
) -> MatrixResponse:
    """The answer to a matrix request, its rows spread by Dask."""
    from app.cli.batch.matrices import matrix_row
    from app.cli.batch.opening import opened_matrix, order_of
    from app.cli.batch.scheduling import workers
    from app.schemas.matrix import MatrixRequest

    service = service_for(graph)
    order = order_of(service)
    if graph is not None:
        body = {"graph": service.settings.default_graph} | body
    sent = MatrixRequest.model_validate(body)
    refuse_uncertain(service, sent.effects, apply_uncertain)
    request = sent.model_dump_json()
    work = opened_matrix(order, request)  # here as well, so that what is wrong with it is said at once
    rows = []
    with stage_bars() as bars, workers(scheduler, threads or os.cpu_count() or 1) as spread:
        report = whole_reporter(bars)
        for row in spread.in_order(matrix_row, ((order, request, idx) for idx in range(work.part_count))):
            rows.append(row)
            report("sources", len(rows) / work.part_count)
    return work.whole(rows)


@batches.command()
def batch(
    *,
    requests: Annotated[
        Path,
        typer.Argument(
            metavar="REQUESTS.csv|.jsonl", help="one body of POST /route a row; in CSV, columns as start.lat"
        ),
    ],
    out: Annotated[
        Path, typer.Option(metavar="FILE.jsonl|.parquet", help="answers or problems, or one flat line a route")
    ],
    graph: GraphOption = None,
    vehicle: Annotated[str | None, typer.Option("--vehicle", help="of rows that name none", metavar="ID")] = None,
    soc: Annotated[float | None, typer.Option("--soc", help="of rows that have none, 0..1")] = None,
    reserve_soc: Annotated[float | None, typer.Option("--reserve-soc", help="of rows that have none, 0..1")] = None,
    links: Annotated[bool, typer.Option("--links", help="with every link of every route, in JSON")] = False,
    scheduler: SchedulerOption = None,
    threads: ThreadsOption = None,
) -> None:
    """Routes for a file of requests; a row that can't be answered has its own problem."""
    from app.cli.batch.results import ROUTE_KINDS, check_results_name, is_flat, written
    from app.cli.batch.scheduling import dask_distributed

    dask_distributed()
    check_results_name(out, ROUTE_KINDS, [requests])
    flat = is_flat(out)
    if links and flat:
        raise CommandError("--links is set, allowed: with --out FILE.jsonl")
    given = {"vehicle": vehicle, "soc": soc, "reserve_soc": reserve_soc, "links": links}
    defaults = {name: value for name, value in given.items() if value is not None}
    began = time.monotonic()
    counts: Counter[str] = Counter()
    with written(out) as write:
        for answer in _answers(requests, graph, defaults, flat, scheduler, threads):
            write(answer.lines)
            counts.update(rows=1, routes=answer.routes, infeasible=answer.infeasible)
            if answer.code is not None:
                counts.update({f"problem {answer.code.value}": 1})
    Console(soft_wrap=True).print(
        f"{_summary(counts)}, {time.monotonic() - began:.1f} s: {out}", markup=False, highlight=False
    )


def _answers(
    requests: Path,
    graph: str | None,
    defaults: dict[str, Any],
    flat: bool,
    scheduler: str | None,
    threads: int | None,
) -> Iterator[RowAnswer]:
    """What is answered to each row of a file, in its order."""
    from app.cli.batch.answers import answered_rows
    from app.cli.batch.opening import order_of
    from app.cli.batch.requests import request_rows
    from app.cli.batch.scheduling import workers

    count = sum(1 for _ in request_rows(requests))
    if count == 0:
        raise CommandError(f"{requests} has no requests, allowed: at least one row")
    service = service_for(graph)
    order = order_of(service)
    if graph is not None:
        defaults = defaults | {"graph": service.settings.default_graph}
    rows = _chunks(request_rows(requests))
    done = 0
    with stage_bars() as bars, workers(scheduler, threads or os.cpu_count() or 1) as spread:
        report = whole_reporter(bars)
        for answers in spread.in_order(answered_rows, ((order, chunk, defaults, flat) for chunk in rows)):
            yield from answers
            done += len(answers)
            report("requests", done / count)


def _chunks(rows: Iterator[RequestRow]) -> Iterator[list[RequestRow]]:
    while chunk := list(islice(rows, ROWS_A_CALL)):
        yield chunk


def _summary(counts: Counter[str]) -> str:
    problems = Counter({name: count for name, count in counts.items() if name.startswith("problem ")})
    text = f"{counts['rows']} requests, {counts['routes']} routes"
    if counts["infeasible"]:
        text += f" ({counts['infeasible']} beyond the charge)"
    if problems:
        shown = [f"{count} {name.removeprefix('problem ')}" for name, count in problems.most_common(SHOWN_CODES)]
        text += f", {problems.total()} problems ({', '.join(shown)})"
    return text
