"""What planning and what the vehicle model got wrong on a matched drive: planned, replayed and measured side by side.

The way is the matched one, so that the choice of route plays no part. Planned and replayed drive share vehicle,
conditions and the heights of the graph: they differ by speed and stops alone, and the replay differs from the
measurement by the vehicle model alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import stats

from diagnosis.answer.results import ProfileSplit
from diagnosis.comparison.tables import NONE, markdown_table, percent
from diagnosis.errors import DiagnosisError
from energy.chain.chain import StopRule, simulate_chain
from energy.conditions import STILL, Conditions
from energy.replay.replay import DrivenProfile, replay
from energy.units import JOULE_PER_KWH
from energy.vehicle.vehicle import CHECKED_SPEED_MPS
from routing.places import LinkSpan

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from diagnosis.matching.map_matcher import Match, Stretch
    from diagnosis.recordings.reading import Recording
    from energy.chain.chain import Chain, ChainResult
    from energy.stops import StopSettings
    from energy.vehicle.files import AnyVehicle
    from routing.planner import Planner

STEP_S: Final = 1.0  # as Recording.profile
STOPPED_MPS: Final = 0.5  # assumed: slower than that is a stop, as it is for most loggers
ROLLING_MPS: Final = 2.0  # assumed: a stop ends above it, so that creeping in a queue is one stop


class NothingMatchedError(DiagnosisError):
    """A recording without a stretch on links: names it and what its match found."""

    def __init__(self, recording_id: str, reasons: str) -> None:
        self.recording_id = recording_id
        self.reasons = reasons
        super().__init__(f"recording {recording_id!r} lies on no link ({reasons}), needed: a matched stretch")


def profile_split(
    recording: Recording,
    match: Match,
    planner: Planner,
    vehicle: AnyVehicle,
    *,
    conditions: Conditions = STILL,
    stop_settings: StopSettings | None = None,
) -> ProfileSplit:
    """Planned, replayed and measured energy of what of a recording was matched, with times and stops.

    planned: by the graph's limits with expected stops, entering and leaving a stretch as fast as it was driven there.
    driven: the model at the recorded speed, at steps of a second, on the graph's heights. measured: ∫P dt. Stops at the
    end of the drive are not counted.
    Raises DiagnosisError where match and recording differ, NothingMatchedError, and what energy.replay.replay raises.
    """
    if match.recording_id != recording.id:
        raise DiagnosisError(f"recording {recording.id!r} comes with the match of recording {match.recording_id!r}")
    if not match.stretches:
        reasons = ", ".join(sorted({gap.reason.value for gap in match.gaps})) or "nothing was driven"
        raise NothingMatchedError(recording.id, reasons)
    planned_j = driven_j = measured_j = planned_s = driven_s = planned_stops = 0.0
    driven_stops = 0
    for stretch in match.stretches:
        chain = planner.chain(_spans(stretch, planner), stop_settings)
        plan = _planned(vehicle, chain, recording, stretch, conditions)
        profile = _driven(recording, stretch, chain)
        here = slice(stretch.first, stretch.last + 1)
        planned_j += plan.energy_j
        planned_s += plan.duration_s
        planned_stops += plan.stop_count
        driven_j += replay(vehicle, profile, conditions=conditions).energy_j
        driven_s += float(profile.time_s[-1] - profile.time_s[0])
        driven_stops += stop_count(recording.speed_mps[here])
        measured_j += float(np.trapezoid(recording.power_w[here], recording.time_s[here]))
    return ProfileSplit(
        trip_id=recording.id,
        planned_kwh=planned_j / JOULE_PER_KWH,
        driven_kwh=driven_j / JOULE_PER_KWH,
        measured_kwh=measured_j / JOULE_PER_KWH,
        planned_s=planned_s,
        driven_s=driven_s,
        planned_stops=planned_stops,
        driven_stops=driven_stops,
    )


def stop_count(speed_mps: NDArray[np.float64]) -> int:
    """Times that a drive comes to a stop and goes on; where it begins and ends are none."""
    stops, rolling, stopped = 0, False, False
    for speed in speed_mps.tolist():
        if speed >= ROLLING_MPS:
            stops += stopped
            rolling, stopped = True, False
        elif speed < STOPPED_MPS:
            stopped = rolling
    return stops


def profile_table(splits: Sequence[ProfileSplit]) -> str:
    """Errors over trips in the manner of the source's table V, apart by cause, as Markdown.

    profile: planned against replayed, relative to the measurement for energy and to the driven value for time and
    stops; vehicle model: replayed against measured; both together: planned against measured. Mean and standard
    deviation (n − 1) of the trips' errors; trips whose reference is not positive are left out of a row.
    """
    rows = [
        _row("energy: profile", splits, lambda s: s.planned_kwh - s.driven_kwh, lambda s: s.measured_kwh),
        _row("energy: vehicle model", splits, lambda s: s.driven_kwh - s.measured_kwh, lambda s: s.measured_kwh),
        _row("energy: both together", splits, lambda s: s.planned_kwh - s.measured_kwh, lambda s: s.measured_kwh),
        _row("travel time", splits, lambda s: s.planned_s - s.driven_s, lambda s: s.driven_s),
        _row("mean speed", splits, lambda s: s.driven_s - s.planned_s, lambda s: s.planned_s),
        _row("stops", splits, lambda s: s.planned_stops - s.driven_stops, lambda s: float(s.driven_stops)),
    ]
    return markdown_table(("", "trips", "mean error", "95 % interval of the mean", "SD"), rows)


def _row(
    name: str,
    splits: Sequence[ProfileSplit],
    error: Callable[[ProfileSplit], float],
    reference: Callable[[ProfileSplit], float],
) -> tuple[str, ...]:
    errors = np.array([error(split) / reference(split) for split in splits if reference(split) > 0.0])
    n = errors.size
    if n == 0:
        return (name, "0", NONE, NONE, NONE)
    mean = float(errors.mean())
    if n == 1:
        return (name, "1", percent(mean), NONE, NONE)
    sd = float(errors.std(ddof=1))
    half = float(stats.t.ppf(0.975, n - 1)) * sd / n**0.5
    return (name, str(n), percent(mean), f"{percent(mean - half)} … {percent(mean + half)}", percent(sd, signed=False))


def _spans(stretch: Stretch, planner: Planner) -> tuple[LinkSpan, ...]:
    """The stretch's links, inner ones over their whole length to the last digit."""
    length_m = planner.graph.length_m
    last = stretch.links.size - 1
    return tuple(
        LinkSpan(
            link,
            float(stretch.from_m[k]) if k == 0 else 0.0,
            float(stretch.to_m[k]) if k == last else float(length_m[link]),
        )
        for k, link in enumerate(stretch.links.tolist())
    )


def _planned(
    vehicle: AnyVehicle, chain: Chain, recording: Recording, stretch: Stretch, conditions: Conditions
) -> ChainResult:
    """The plan for a stretch that begins as fast as it was driven, within the first limit, and ends at rest or not."""
    start_mps = min(float(recording.speed_mps[stretch.first]), float(chain.speed_limit_mps[0]), CHECKED_SPEED_MPS)
    return simulate_chain(
        vehicle,
        chain,
        conditions=conditions,
        stop_rule=StopRule.EXPECTED,
        start_speed_mps=start_mps if start_mps >= STOPPED_MPS else 0.0,
        arrive_stopped=float(recording.speed_mps[stretch.last]) < ROLLING_MPS,
    )


def _driven(recording: Recording, stretch: Stretch, chain: Chain) -> DrivenProfile:
    """The recorded speed over a stretch at equal steps, with grade, altitude and heading of the links below it."""
    here = slice(stretch.first, stretch.last + 1)
    begin_s, end_s = float(recording.time_s[stretch.first]), float(recording.time_s[stretch.last])
    time_s = np.append(np.arange(begin_s, end_s - 1e-3 * STEP_S, STEP_S), end_s)
    speed = np.interp(time_s, recording.time_s[here], recording.speed_mps[here])
    ends_m = np.concatenate(([0.0], np.cumsum(chain.length_m)))
    height_m = np.concatenate(([0.0], np.cumsum(chain.length_m * chain.grade_frac)))
    along_m = np.interp(time_s, recording.time_s[here], stretch.along_m)
    step_m = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time_s)
    rise_m, road_m = np.diff(np.interp(along_m, ends_m, height_m)), np.diff(along_m)
    grade = np.divide(rise_m, road_m, out=np.zeros_like(rise_m), where=road_m > 0.0)
    # an odometer that counts too little must not climb too little
    grade *= (along_m[-1] - along_m[0]) / step_m.sum()
    link = np.clip(np.searchsorted(ends_m, 0.5 * (along_m[1:] + along_m[:-1]), side="right") - 1, 0, ends_m.size - 2)
    return DrivenProfile(
        time_s=time_s,
        speed_mps=speed,
        grade_frac=np.clip(grade, -1.0, 1.0),
        heading=None if chain.heading is None else chain.heading[link],
        altitude_m=None if chain.altitude_m is None else chain.altitude_m[link],
    )
