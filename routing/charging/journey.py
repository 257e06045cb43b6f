"""A journey over the station graph as a plan: driven again as a whole, with charge and clock carried on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from energy.battery import soc_along
from energy.charging.charge_time import power_bands, seconds
from energy.units import JOULE_PER_KWH, SECOND_PER_MINUTE
from routing.charging.plan import ChargeStop, Halt, PassedStation, Plan, PlanLeg
from routing.places import LinkSpan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.charging.network import Arc, Part, Step
    from routing.charging.plan import FixedStay
    from routing.charging.task import Task
    from routing.charging.ways import Way
    from routing.links.spans import ChainMaker
    from routing.route.best_path import RouteSearch
    from routing.stations.station import Station


Passed: TypeAlias = tuple[PassedStation, ...]

NOTHING_FRAC: Final = 1e-9  # of the capacity, that is no charge


@dataclass(frozen=True, slots=True)
class _Drive:
    """What is driven without a stop, over via points at which nobody stays, and the stop at its end.

    place: of the station graph where it ends. depart_j: charge at departure from a station there; stay: at a via point.
    halts: after so many parts, at which place of the station graph.
    """

    parts: tuple[Part, ...]
    place: int
    depart_j: float = 0.0
    stay: FixedStay | None = None
    halts: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class _Course:
    """How a drive goes on: from a clock [s] and a distance since the start [m] on, time [s] and length [m] of each of
    its n stretches, and the charge before and after them, float64 (n + 1,).
    """

    clock_s: float
    along_m: float
    time_s: NDArray[np.float64]
    length_m: NDArray[np.float64]
    soc_frac: NDArray[np.float64]


class JourneyMaker:
    """Plans of one task from steps on its station graph."""

    def __init__(self, search: RouteSearch, chains: ChainMaker, task: Task) -> None:
        self._search, self._chains, self._task = search, chains, task

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

    def leg(self, arc: Arc) -> PlanLeg:
        """An arc as a leg from rest to rest, of which only what is driven is told."""
        (part,) = arc.parts
        spans = self._resting(_Drive(arc.parts, arc.to), last=False)
        way = part.way
        return PlanLeg(spans, way.time_s, way.energy_j, 0.0, 1.0, 0.0, 0.0, speed_cap_mps=self._task.cap_mps(part.cap))

    def stretches(self, steps: Sequence[Step]) -> list[tuple[list[Step], int]]:
        """Steps that are driven from one stop that is charged as planned to the next, and how many legs each makes."""
        found: list[tuple[list[Step], int]] = []
        driven: list[Step] = []
        for k, step in enumerate(steps[1:], start=1):
            driven.append(step)
            if k + 1 == len(steps) or self._is_charged(step, steps[k + 1]):
                parts = [part for each in driven if each.arc is not None for part in each.arc.parts]
                stays = sum(part.there < 0 and self._task.stay_at(-1 - part.there) is not None for part in parts)
                found.append((driven, 1 + stays))
                driven = []
        return found

    def _is_charged(self, step: Step, after: Step) -> bool:
        return after.depart_j > step.charge_j + NOTHING_FRAC * self._task.capacity_j

    def _drives(self, steps: Sequence[Step]) -> list[_Drive]:
        drives: list[_Drive] = []
        parts: list[Part] = []
        halts: list[tuple[int, int]] = []
        for k, step in enumerate(steps[1:], start=1):
            assert step.arc is not None
            for part in step.arc.parts:
                parts.append(part)
                stay = self._task.stay_at(-1 - part.there) if part.there < 0 else None
                if stay is not None:
                    drives.append(_Drive(tuple(parts), part.there, stay=stay, halts=tuple(halts)))
                    parts, halts = [], []
            depart_j = steps[k + 1].depart_j if k + 1 < len(steps) else step.charge_j
            if step.place == self._task.goal or depart_j > step.charge_j + NOTHING_FRAC * self._task.capacity_j:
                drives.append(_Drive(tuple(parts), step.place, depart_j, halts=tuple(halts)))
                parts, halts = [], []
            else:
                halts.append((len(parts), step.place))
        return drives

    def _halts(self, drive: _Drive, course: _Course) -> tuple[Halt, ...]:
        """The halts of a drive."""
        found: list[Halt] = []
        ends = np.cumsum([0, *(part.way.links.size for part in drive.parts)])
        for count, place in drive.halts:
            end = int(ends[count])
            arrive_s = course.clock_s + float(course.time_s[:end].sum()) + sum(halt.overhead_s for halt in found)
            station = self._task.site_at(place).station
            waiting_s = self._task.waiting_s(place, arrive_s)
            found.append(
                Halt(
                    station=station,
                    position=station.position[0],
                    along_m=course.along_m + float(course.length_m[:end].sum()),
                    arrive_s=arrive_s,
                    overhead_s=self._task.charging.overhead_s + waiting_s,
                    waiting_s=waiting_s,
                    soc_frac=float(course.soc_frac[end]),
                    price=_price(station, 0.0, 0.0),
                    currency="" if station.price is None else station.price.currency,
                )
            )
        return tuple(found)

    def _passed(self, drive: _Drive, time_s: NDArray[np.float64], halts: Sequence[Halt], clock_s: float) -> Passed:
        """Via points of a drive that begins at a clock which are stations, at which it does not stop."""
        chosen = dict(self._task.charging.via_stations)
        found = []
        ends = np.cumsum([0, *(part.way.links.size for part in drive.parts)])
        for k, part in enumerate(drive.parts):
            via_idx = -1 - part.there
            place = self._task.place_of(chosen[via_idx]) if part.there < 0 and via_idx in chosen else None
            if place is None:
                continue
            halted_s = sum(halt.overhead_s for halt, (count, _) in zip(halts, drive.halts, strict=True) if count <= k)
            arrive_s = clock_s + float(time_s[: ends[k + 1]].sum()) + halted_s
            waiting_s = self._task.waiting_s(place, arrive_s)
            found.append(PassedStation(via_idx, self._task.site_at(place).station, arrive_s, waiting_s))
        return tuple(found)

    def plan(self, name: str, steps: Sequence[Step], short_by: float | None, why: str) -> Plan:
        """The plan of steps from start to goal, along known ways."""
        task, query = self._task, self._task.query
        drives = self._drives(steps)
        spans = [self._resting(drive, last=k == len(drives) - 1) for k, drive in enumerate(drives)]
        driven = self._driven(drives, spans)
        soc, clock_s, along_m = query.soc_frac, 0.0, 0.0
        legs: list[PlanLeg] = []
        stops: list[ChargeStop] = []
        passed: Passed = ()
        for drive, stretches, (energy_j, time_s) in zip(drives, spans, driven, strict=True):
            charge, _ = soc_along(energy_j, soc, query.vehicle.usable_capacity_wh)
            end = float(charge[-1]) if stretches else soc
            leg_s = float(time_s.sum())
            length_m = np.array([span.to_m - span.from_m for span in stretches])
            halts = self._halts(drive, _Course(clock_s, along_m, time_s, length_m, np.append(soc, charge)))
            legs.append(
                PlanLeg(
                    spans=stretches,
                    time_s=leg_s,
                    energy_j=float(energy_j.sum()),
                    distance_m=float(length_m.sum()),
                    soc_start_frac=soc,
                    soc_end_frac=end,
                    soc_min_frac=float(min(soc, charge.min())) if stretches else soc,
                    speed_cap_mps=task.cap_mps(max(part.cap for part in drive.parts)),
                    caps=tuple((len(self.spans(part.way)), task.cap_mps(part.cap)) for part in drive.parts),
                    halts=halts,
                )
            )
            passed += self._passed(drive, time_s, halts, clock_s)
            clock_s, soc = clock_s + leg_s + sum(halt.overhead_s for halt in halts), end
            along_m += legs[-1].distance_m
            if drive.place != task.goal:
                stop = self._stay(drive, clock_s, soc) if drive.stay is not None else self._stop(drive, clock_s, soc)
                stops.append(stop)
                clock_s, soc = stop.depart_s, stop.depart_soc_frac
        at_goal = task.stay_at(None)
        halted = [halt for leg in legs for halt in leg.halts]
        price, currency = _paid([*(stop for stop in stops if stop.station is not None), *halted])
        return Plan(
            name=name,
            legs=tuple(legs),
            stops=tuple(stops),
            driving_s=sum(leg.time_s for leg in legs),
            charging_s=sum(stop.charging_s for stop in stops),
            overhead_s=sum(stop.overhead_s for stop in stops) + sum(halt.overhead_s for halt in halted),
            energy_j=sum(leg.energy_j for leg in legs),
            objective=steps[-1].cost,
            short_by=short_by,
            unproven=why,
            price=price,
            currency=currency,
            passed=passed,
            goal_stay=None if at_goal is None else self._stay(_Drive((), task.goal, stay=at_goal), clock_s, soc),
        )

    def _resting(self, drive: _Drive, *, last: bool) -> tuple[LinkSpan, ...]:
        """The stretches of a drive, at rest at the end of each part but at the goal."""
        parts = [self.spans(part.way) for part in drive.parts]
        stretches = tuple(
            replace(span, rest=True) if k == len(part) - 1 else span for part in parts for k, span in enumerate(part)
        )
        if last and stretches:
            stretches = (*stretches[:-1], replace(stretches[-1], rest=False))
        return stretches

    def _driven(
        self, drives: Sequence[_Drive], spans: Sequence[tuple[LinkSpan, ...]]
    ) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Energy [J] and time [s] of each stretch of each drive, with the clock of climate and tyres carried on."""
        whole = tuple(span for stretches in spans for span in stretches)
        if not whole:
            return [(np.empty(0), np.empty(0))] * len(spans)
        if whole[-1].rest:  # nothing is driven to the goal
            whole = (*whole[:-1], replace(whole[-1], rest=False))
        caps = np.concatenate([np.full(part.way.links.size, part.cap) for drive in drives for part in drive.parts])
        energy_j, time_s = np.empty(len(whole)), np.empty(len(whole))
        for cap in np.unique(caps).tolist():
            under = self._search.link_energies(self._task.queries[cap], whole, None)
            energy_j[caps == cap], time_s[caps == cap] = under[0][caps == cap], under[1][caps == cap]
        ends = np.cumsum([len(stretches) for stretches in spans])[:-1]
        return list(zip(np.split(energy_j, ends), np.split(time_s, ends), strict=True))

    def _stop(self, drive: _Drive, arrive_s: float, arrive: float) -> ChargeStop:
        """A stop at a station, which is left with the charge that was planned, or more where more is left."""
        task = self._task
        site = task.site_at(drive.place)
        depart = min(max(arrive, drive.depart_j / task.capacity_j), 1.0)
        charged_j = (depart - arrive) * task.capacity_j
        charging_s = float(seconds(site.curve, task.capacity_j, max(arrive, 0.0), depart))
        overhead_s = task.charging.overhead_s
        drawn_j = charged_j / site.wall_eff
        price = site.station.price
        waits_s = task.waiting_s(drive.place, arrive_s)
        return ChargeStop(
            station=site.station,
            socket=site.socket,
            position=site.station.position[0],
            arrive_s=arrive_s,
            depart_s=arrive_s + waits_s + overhead_s + charging_s,
            overhead_s=overhead_s + waits_s,
            waiting_s=waits_s,
            charging_s=charging_s,
            arrive_soc_frac=arrive,
            depart_soc_frac=depart,
            charged_j=charged_j,
            drawn_j=drawn_j,
            mean_power_w=charged_j / charging_s if charging_s > 0.0 else 0.0,
            power_bands=power_bands(site.curve, task.capacity_j, arrive, depart) if charging_s > 0.0 else (),
            price=_price(site.station, drawn_j, charging_s),
            currency="" if price is None else price.currency,
        )

    def _stay(self, drive: _Drive, arrive_s: float, arrive: float) -> ChargeStop:
        """A fixed stay, at which the battery is charged as long as it has room."""
        task, stay = self._task, drive.stay
        assert stay is not None
        depart = min(arrive + task.stay_gain_j(stay) / task.capacity_j, 1.0)
        charged_j = (depart - arrive) * task.capacity_j
        power_w = task.stay_gain_j(stay) / stay.seconds if stay.seconds > 0.0 else 0.0
        charging_s = charged_j / power_w if power_w > 0.0 else 0.0
        return ChargeStop(
            station=None,
            socket=None,
            position=task.position(drive.place)[0],
            arrive_s=arrive_s,
            depart_s=arrive_s + stay.seconds,
            overhead_s=stay.seconds - charging_s,
            charging_s=charging_s,
            arrive_soc_frac=arrive,
            depart_soc_frac=depart,
            charged_j=charged_j,
            drawn_j=min(stay.power_w, power_w / task.ac_eff) * charging_s,
            mean_power_w=power_w if charging_s > 0.0 else 0.0,
        )


def _price(station: Station, drawn_j: float, charging_s: float) -> float | None:
    """What a stop costs, in the station's currency; None where it gives no price in numbers."""
    price = station.price
    if price is None or (price.per_kwh is None and price.per_min is None and price.per_session is None):
        return None
    return (
        (price.per_kwh or 0.0) * drawn_j / JOULE_PER_KWH
        + (price.per_min or 0.0) * charging_s / SECOND_PER_MINUTE
        + (price.per_session or 0.0)
    )


def _paid(visits: Sequence[ChargeStop | Halt]) -> tuple[float | None, str]:
    """Price of all visits of stations, and its currency; None and "" where one has none in numbers, or they differ."""
    currencies = {visit.currency for visit in visits}
    if len(currencies) != 1 or any(visit.price is None for visit in visits):
        return None, ""
    return sum(visit.price for visit in visits if visit.price is not None), currencies.pop()
