"""Steps of routes into answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.conversions.place import DECIMALS
from energy.units import JOULE_PER_KWH, KMH_PER_MPS
from routing.guidance.instructions import instruction_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from routing.guidance.step import Intersection, Lane, Step

BEARING_DIGITS: Final = 1  # of degrees
SPEED_DIGITS: Final = 9  # of km/h, so that a cap comes back as it was sent


def step_answers(steps: Iterable[Step], kept: NDArray[np.int64] | None = None) -> list[dict[str, object]]:
    """The fields of a StepAnswer in their order, one dictionary a step.

    kept: positions of the points of the route's line that are answered, None where all are.
    """
    answers = [_step(step) for step in steps]
    if kept is not None:
        for name in ("geometry_first", "geometry_last"):
            for answer, position in zip(answers, np.searchsorted(kept, [a[name] for a in answers]), strict=True):
                answer[name] = int(position)
    return answers


def _step(step: Step) -> dict[str, Any]:
    return {
        "type": step.type,
        "modifier": step.modifier,
        "instruction": instruction_of(step),
        "at": _place(step.at),
        "bearing_before": round(step.bearing_before_deg, BEARING_DIGITS),
        "bearing_after": round(step.bearing_after_deg, BEARING_DIGITS),
        "name": step.name,
        "ref": step.ref,
        "destinations": step.destinations,
        "exits": step.exits,
        "exit": step.exit,
        "rotary_name": step.rotary_name,
        "mode": step.mode,
        "lanes": _lanes(step.lanes),
        "intersections": [_intersection(junction) for junction in step.intersections],
        "distance_m": step.distance_m,
        "duration_s": step.duration_s,
        "energy_kwh": step.energy_j / JOULE_PER_KWH,
        "soc_start": step.soc_start_frac,
        "soc_end": step.soc_end_frac,
        "ends_at": step.ends_at,
        "speed_cap_kmh": None if step.speed_cap_mps is None else round(step.speed_cap_mps * KMH_PER_MPS, SPEED_DIGITS),
        "first_link": step.first_link,
        "last_link": step.last_link,
        "geometry_first": step.geometry_first,
        "geometry_last": step.geometry_last,
    }


def _place(at: tuple[float, float]) -> dict[str, float]:
    return {"lat": round(at[0], DECIMALS), "lon": round(at[1], DECIMALS)}


def _lanes(lanes: tuple[Lane, ...]) -> list[dict[str, object]]:
    return [{"indications": list(lane.indications), "valid": lane.valid} for lane in lanes]


def _intersection(junction: Intersection) -> dict[str, object]:
    return {
        "at": _place(junction.location),
        "bearings": list(junction.bearings),
        "entry": list(junction.entry),
        "in_idx": junction.in_idx,
        "out_idx": junction.out_idx,
        "lanes": _lanes(junction.lanes),
    }
