"""Plans with charging stops as tables for a terminal."""

from __future__ import annotations

import math
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from rich.markup import escape
from rich.table import Table

from energy.units import SECOND_PER_HOUR, SECOND_PER_MINUTE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.schemas.charging import ChargingPlanAnswer, ChargingStopAnswer, NoPlanAnswer, StopStation
    from app.schemas.route import RouteFound, RouteLegAnswer
    from app.schemas.stations.facts import StationSourceAnswer


def plan_table(route: RouteFound, plan: ChargingPlanAnswer, departure: datetime | None) -> Table:
    """A drive or a stop a line, in their order, and the sum."""
    table = Table("", title=f"{route.name}: {_stops_text(len(plan.stops))}", title_justify="left")
    for heading in ("time", "min", "km", "kWh", "charge %"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("where")
    clock_s = 0.0
    stops = {stop.leg: stop for stop in plan.stops}
    for k, leg in enumerate(route.legs):
        halts = [halt for halt in plan.halts if halt.leg == k]
        end_s = clock_s + leg.duration_s + sum(halt.overhead_s for halt in halts)
        stop = stops.get(k)
        table.add_row(
            "drive",
            _span(departure, clock_s, end_s),
            _minutes(leg.duration_s),
            f"{(leg.to_m - leg.from_m) / 1000.0:.1f}",
            f"{-leg.battery_kwh:+.1f}",
            _charges(leg.soc_start, leg.soc_end),
            _leg_text(leg),
        )
        clock_s = end_s
        for halt in halts:
            table.add_row(
                "halt",
                _span(departure, halt.arrive_s, halt.depart_s),
                _minutes(halt.overhead_s),
                "",
                "",
                f"{100.0 * halt.soc:.1f}",
                f"on that drive, at {escape(_name(halt.station))}, without charging",
                style="yellow",
            )
        if stop is not None:
            clock_s = stop.depart_s
            table.add_row(
                "charge" if stop.charging_s > 0.0 else "stay",
                _span(departure, stop.arrive_s, stop.depart_s),
                _minutes(stop.depart_s - stop.arrive_s),
                "",
                f"{stop.charged_kwh:+.1f}",
                _charges(stop.arrive_soc, stop.depart_soc),
                _stop_text(stop),
                style="green",
            )
    table.add_section()
    totals = plan.totals
    table.add_row(
        "sum",
        _span(departure, 0.0, totals.total_s),
        _minutes(totals.total_s),
        f"{route.distance_m / 1000.0:.1f}",
        f"{totals.charged_kwh - route.battery_kwh:+.1f}",
        _charges(route.soc_start, route.soc_end),
        "",
    )
    return table


def power_table(plan: ChargingPlanAnswer) -> Table | None:
    """Minutes of charging by power into the battery, a stop a line; None where nothing is charged."""
    stops = [(k, stop) for k, stop in enumerate(plan.stops, 1) if stop.power_bands]
    if not stops:
        return None
    bands = sorted({(band.from_kw, band.to_kw or math.inf) for _, stop in stops for band in stop.power_bands})
    table = Table("minutes at stop")
    for from_kw, to_kw in bands:
        table.add_column(
            f"{from_kw:g} to {to_kw:g} kW" if math.isfinite(to_kw) else f"from {from_kw:g} kW", justify="right"
        )
    for k, stop in stops:
        seconds = {(band.from_kw, band.to_kw or math.inf): band.seconds for band in stop.power_bands}
        table.add_row(str(k), *(_minutes(seconds[band]) if band in seconds else "" for band in bands))
    return table


def totals_line(plan: ChargingPlanAnswer) -> str:
    """Where the time of a plan goes, and what it costs."""
    totals = plan.totals
    waiting = f" ({_minutes(totals.waiting_s)} of them until stations open)" if totals.waiting_s > 0.0 else ""
    return (
        f"driving {_minutes(totals.driving_s)}, charging {_minutes(totals.charging_s)}, overhead "
        f"{_minutes(totals.overhead_s)} min{waiting}; {totals.drawn_kwh:.1f} kWh from the wall"
        f"{_price_text(totals.price, totals.currency, ', ')}"
    )


def proof_line(plan: ChargingPlanAnswer) -> str:
    """What is proven of a plan."""
    proof = plan.proof
    if proof.proven:
        return "proven: no other plan is better"
    why = f": {proof.unproven}" if proof.unproven else ""
    if proof.short_by is None:
        return f"not proven to be the best{why}"
    return f"another plan may be better by at most {proof.short_by:.4g} {plan.objective_unit}{why}"


def promise_lines(plan: ChargingPlanAnswer) -> list[str]:
    """How sure the arrival is, and where to go should a station fail."""
    lines = []
    goal = plan.goal
    if goal.arrive_soc_p10 is not None and goal.arrive_soc_p90 is not None:
        lines.append(f"charge at the goal: {goal.arrive_soc_p10:.1%} to {goal.arrive_soc_p90:.1%} in 8 of 10 drives")
    if plan.probability_kept is not None:
        lines.append(f"{plan.probability_kept:.1%} sure to arrive everywhere with what is asked, if no charger fails")
    for k, stop in enumerate(plan.stops, 1):
        elsewhere = stop.fallback
        if elsewhere is not None:
            there = f"arriving with {elsewhere.arrive_soc:.1%}" if elsewhere.reached else "not reached"
            if elsewhere.wait_s > 0.0:
                there += f", open {_minutes(elsewhere.wait_s)} min later with {elsewhere.open_soc:.1%}"
            name = elsewhere.station_name or elsewhere.station_id
            lines.append(f"should stop {k} fail: {name}, {_minutes(elsewhere.drive_s)} min farther, {there}")
    return lines


def no_plan_lines(no_plan: NoPlanAnswer) -> list[str]:
    """Why there is no plan, and what would help."""
    lines = [f"no charging stops make the goal reachable: {no_plan.reason}"]
    if no_plan.last_reached is not None:
        lines.append(f"last station in reach: {_name(no_plan.last_reached)}")
    lines += [f"would help: {each.text}" for each in no_plan.helps]
    return lines


def sources_line(sources: Sequence[StationSourceAnswer]) -> str:
    """Whose data stations are."""
    return "stations: " + "; ".join(f"{source.name} ({source.licence})" for source in sources)


def _stops_text(count: int) -> str:
    return "no stop" if count == 0 else f"{count} stop{'' if count == 1 else 's'}"


def _minutes(seconds: float) -> str:
    return f"{seconds / SECOND_PER_MINUTE:.1f}"


def _charges(begin: float, end: float) -> str:
    return f"{100.0 * begin:.1f} → {100.0 * end:.1f}"


def _span(departure: datetime | None, begin_s: float, end_s: float) -> str:
    return f"{_clock(departure, begin_s)} → {_clock(departure, end_s)}"


def _clock(departure: datetime | None, seconds: float) -> str:
    """Time of day, or hours and minutes since departure where that is not known."""
    if departure is not None:
        try:
            return (departure + timedelta(seconds=seconds)).strftime("%H:%M")
        except OverflowError:
            pass
    minutes = round(seconds / SECOND_PER_MINUTE)
    per_hour = round(SECOND_PER_HOUR / SECOND_PER_MINUTE)
    return f"{minutes // per_hour}:{minutes % per_hour:02d}"


def _leg_text(leg: RouteLegAnswer) -> str:
    cap = "" if leg.speed_cap_kmh is None else f", at most {leg.speed_cap_kmh:g} km/h"
    return f"to the {leg.ends_at.value}{cap}".replace("the via", "a via point").replace("the stop", "a stop")


def _stop_text(stop: ChargingStopAnswer) -> str:
    if stop.station is None:
        return f"a stay, {stop.mean_power_kw:.1f} kW" if stop.charging_s > 0.0 else "a stay"
    socket = stop.socket
    plug = ""
    if socket is not None:
        output = "" if socket.output_kw is None else f" {socket.output_kw:g} kW"
        plug = f", {socket.connector.value}{output}"
    waits = f", closed for {_minutes(stop.waiting_s)} min" if stop.waiting_s > 0.0 else ""
    keeper = ", no way without it" if stop.gatekeeper else ""
    kept = "" if stop.probability_kept is None else f", {stop.probability_kept:.1%} sure to get there"
    price = _price_text(stop.price, stop.currency, ", ")
    return f"{escape(_name(stop.station))}{plug}, mean {stop.mean_power_kw:.0f} kW{price}{waits}{kept}{keeper}"


def _price_text(price: float | None, currency: str, before: str) -> str:
    return "" if price is None else f"{before}{price:.2f} {currency}".rstrip()


def _name(station: StopStation) -> str:
    return station.name or station.operator or station.id
