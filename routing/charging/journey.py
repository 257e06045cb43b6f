"""A journey over the station graph as a plan: driven again as a whole, with charge and clock carried on."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from energy.battery import soc_along
from energy.charging.charge_time import power_bands, seconds
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, SECOND_PER_MINUTE
from routing.charging.plan import ChargeStop, Plan, PlanLeg
from routing.places import LinkSpan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from routing.charging.network import Step
    from routing.charging.plan import ChargingQuery
    from routing.charging.sites import Site
    from routing.charging.ways import Way
    from routing.links.spans import ChainMaker
    from routing.queries import RouteQuery
    from routing.route.best_path import RouteSearch


class JourneyMaker:
    """Plans of one query from steps on its station graph."""

    def __init__(
        self,
        search: RouteSearch,
        chains: ChainMaker,
        query: RouteQuery,
        charging: ChargingQuery,
        sites: Sequence[Site],
    ) -> None:
        self._search, self._chains, self._query, self._charging = search, chains, query, charging
        self._sites = sites
        self._capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH

    def spans(self, way: Way) -> tuple[LinkSpan, ...]:
        """The stretches of links that a way drives."""
        if way.start is None or way.goal is None:
            return ()
        last = way.links.size - 1
        length_m = self._search.graph.length_m
        return tuple(
            LinkSpan(
                link,
                way.start.offset_m if k == 0 else 0.0,
                way.goal.offset_m if k == last else float(length_m[link]),
            )
            for k, link in enumerate(way.links.tolist())
        )

    def plan(self, name: str, steps: Sequence[Step], short_by: float | None, why: str) -> Plan:
        """The plan of steps from start to goal, along known ways."""
        ways = [[self.spans(part.way) for part in step.arc.parts] for step in steps[1:] if step.arc is not None]
        legs_spans = [
            tuple(
                replace(span, rest=True) if k == len(part) - 1 else span
                for part in parts
                for k, span in enumerate(part)
            )
            for parts in ways
        ]
        legs_spans[-1] = (*legs_spans[-1][:-1], *(replace(span, rest=False) for span in legs_spans[-1][-1:]))
        whole = tuple(span for spans in legs_spans for span in spans)
        energy_j, time_s = self._search.link_energies(self._query, whole, None) if whole else (np.empty(0),) * 2
        soc, clock_s, first = self._query.soc_frac, 0.0, 0
        legs: list[PlanLeg] = []
        stops: list[ChargeStop] = []
        for k, (spans, step) in enumerate(zip(legs_spans, steps[1:], strict=True)):
            if k > 0:
                stop = self._stop(steps[k], clock_s, soc, step.depart_j / self._capacity_j)
                stops.append(stop)
                clock_s, soc = stop.depart_s, stop.depart_soc_frac
            last = first + len(spans)
            charge, _ = soc_along(energy_j[first:last], soc, self._query.vehicle.usable_capacity_wh)
            leg_s, end = float(time_s[first:last].sum()), float(charge[-1]) if spans else soc
            legs.append(
                PlanLeg(
                    spans=spans,
                    time_s=leg_s,
                    energy_j=float(energy_j[first:last].sum()),
                    distance_m=sum(span.to_m - span.from_m for span in spans),
                    soc_start_frac=soc,
                    soc_end_frac=end,
                    soc_min_frac=float(min(soc, charge.min())) if spans else soc,
                )
            )
            clock_s, soc, first = clock_s + leg_s, end, last
        return Plan(
            name=name,
            legs=tuple(legs),
            stops=tuple(stops),
            driving_s=sum(leg.time_s for leg in legs),
            charging_s=sum(stop.charging_s for stop in stops),
            overhead_s=sum(stop.overhead_s for stop in stops),
            energy_j=sum(leg.energy_j for leg in legs),
            objective=steps[-1].cost,
            short_by=short_by,
            unproven=why,
        )

    def _stop(self, step: Step, arrive_s: float, arrive: float, depart: float) -> ChargeStop:
        site = self._sites[(step.place - 1) % len(self._sites)]
        depart = max(arrive, depart)
        charged_j = (depart - arrive) * self._capacity_j
        charging_s = float(seconds(site.curve, self._capacity_j, arrive, depart))
        overhead_s = self._charging.overhead_s
        drawn_j = charged_j / site.wall_eff
        price = site.station.price
        cost = None
        if price is not None and not (price.per_kwh is None and price.per_min is None and price.per_session is None):
            cost = (
                (price.per_kwh or 0.0) * drawn_j / JOULE_PER_KWH
                + (price.per_min or 0.0) * charging_s / SECOND_PER_MINUTE
                + (price.per_session or 0.0)
            )
        return ChargeStop(
            station=site.station,
            socket=site.socket,
            position=site.station.position[0],
            arrive_s=arrive_s,
            depart_s=arrive_s + overhead_s + charging_s,
            overhead_s=overhead_s,
            charging_s=charging_s,
            arrive_soc_frac=arrive,
            depart_soc_frac=depart,
            charged_j=charged_j,
            drawn_j=drawn_j,
            mean_power_w=charged_j / charging_s if charging_s > 0.0 else 0.0,
            power_bands=power_bands(site.curve, self._capacity_j, arrive, depart) if charging_s > 0.0 else (),
            price=cost,
            currency="" if price is None else price.currency,
        )
